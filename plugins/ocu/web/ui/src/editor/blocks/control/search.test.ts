import { describe, expect, it } from "vitest";
import { BLOCK_CLASS, intendedEntry, searchByIntent } from "./search";
import { KINDS, type Options } from "./fragments";

const entry = (label: string, className = "") => ({ label, className, search: "", action: {} });
const meant = KINDS.map((kind) =>
  intendedEntry(entry(`block ${kind}`), kind, ({ duration = "" }: Options) =>
    entry(`block ${kind} ${duration}`),
  ),
);
const all = [
  ...meant,
  entry("Ask the operator", BLOCK_CLASS),
  entry("Parallel gateway"),
  entry("Call activity"),
  entry("Orbit", BLOCK_CLASS),
];
const found = (typed: string) =>
  searchByIntent(all as never, typed, { keys: ["label", "search"] }).map(({ item }) => item.label);

describe("the search of the menus", () => {
  it("has what is meant first, then what is called so", () => {
    expect(found("parallel")).toEqual(["block same", "Parallel gateway"]);
    expect(found("call")[0]).toBe("block call");
    expect(found("call")).toContain("Call activity");
  });

  it("has what is said about it in the entry", () => {
    expect(found("in 5 minutes")[0]).toBe("block wait PT5M");
  });

  it("keeps what is called just so, and the fleet's blocks, before what may be meant", () => {
    expect(found("Call activity")[0]).toBe("Call activity");
    expect(found("ask")[0]).toBe("Ask the operator");
    expect(found("orbit")).toEqual(["Orbit"]);
  });
});
