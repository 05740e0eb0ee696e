import { describe, expect, it } from "vitest";
import type { RunRecord } from "../shared/types";
import { PROMPTS, SERVICES, Spans, WAITS } from "./spans";
import { RECORDS } from "./testing";

function after(seq: number): Spans {
  const spans = new Spans();
  for (const record of RECORDS.slice(0, seq)) spans.add(record);
  return spans;
}

describe("spans", () => {
  it("has a bar for each behavior on each of its vehicles", () => {
    const spans = new Spans();
    spans.add({ ...RECORDS[6]!, resources: ["v1", "v2/cam"] });
    expect(spans.all.map(({ row, from, to }) => [row, from, to])).toEqual([
      ["v1", 4, null],
      ["v2/cam", 4, null],
    ]);
  });

  it("ends bars as their records say", () => {
    const [prompt, behavior, service] = after(14).all;
    expect(prompt).toMatchObject({ row: PROMPTS, to: 4, end: "succeeded", reason: "y (anna)" });
    expect(behavior).toMatchObject({ row: "v1", from: 4, to: 9, end: "failed", reason: "BLOCKED" });
    expect(service).toMatchObject({ row: SERVICES, from: 4, to: 9, end: "cancelled" });
  });

  it("has a bar for a task that waits, from when it asked", () => {
    const at = { process: "P", element: "Drive" };
    const spans = new Spans();
    const facts: [number, string, object][] = [
      [1, "AllocationRequested", { ...at, allocation: "r1.a1", name: "goto" }],
      [1, "AllocationRequested", { ...at, allocation: "r1.a2", name: "goto" }],
      [2, "ResourcesAllocated", { ...at, allocation: "r1.a1", roles: { scout: ["v1"] } }],
      [3, "AllocationDelayed", { allocation: "r1.a2", reason: "v1 is held", holders: {} }],
      [9, "ResourcesAllocated", { ...at, allocation: "r1.a2", roles: { scout: ["v2"] } }],
    ];
    facts.forEach(([t, record, fields], index) =>
      spans.add({ run: "r1", seq: index + 1, t, record, ...fields } as RunRecord),
    );
    expect(spans.all).toMatchObject([
      { row: WAITS, from: 1, to: 9, end: "succeeded", label: "goto", reason: "v2" },
    ]);
  });

  it("takes over what is commanded where records are missing", () => {
    const spans = after(2);
    const command = { name: "go", resources: ["v1"], process: "P", element: "Drive", since: 3 };
    spans.settle({ "r1.b7": command }, 8);
    spans.settle({ "r1.b7": command }, 9);
    expect(spans.all).toHaveLength(1);
    expect(spans.all[0]).toMatchObject({ row: "v1", from: 3, to: null, end: "" });
    spans.settle({}, 12);
    expect(spans.all[0]).toMatchObject({ to: 12, end: "unknown" });
  });

  it("keeps a bar that both told of once", () => {
    const spans = after(7);
    spans.settle(
      { "r1.b1": { name: "go", resources: ["v1"], process: "P", element: "Drive", since: 4 } },
      5,
    );
    expect(spans.all.filter((span) => span.kind === "behavior")).toHaveLength(1);
  });
});
