import { describe, expect, it } from "vitest";
import type { Requirement } from "../../shared/types";
import type { MissionNode } from "../mission/missionModel";
import { keyOf } from "../mission/names";
import { inOrder, violationsIn } from "./violations";

const requirement = (verdict: Requirement["verdict"], ...elements: string[]): Requirement => ({
  english: "",
  formula: "",
  elements,
  on_violation: "",
  verdict,
  since: verdict === "open" ? null : 1,
  recorded: verdict === "open" ? null : 1,
  because: "",
});

const node = (process: string, id: string) => ({ process, id }) as MissionNode;

const NODES: Record<string, MissionNode[]> = {
  A: [node("P", "A")],
  B: [node("P", "B"), node("Q", "B")],
};

const mission = { nodesOf: (id: string) => NODES[id] ?? [] };

describe("violated requirements of a run", () => {
  it("mark the elements that they are about, wherever these are drawn", () => {
    const found = violationsIn(
      {
        one: requirement("violated", "A", "B"),
        two: requirement("violated", "A", "Unknown"),
        three: requirement("satisfied", "A"),
        four: requirement("open", "B"),
      },
      mission,
    );
    expect(Object.fromEntries(found)).toEqual({
      [keyOf("P", "A")]: ["one", "two"],
      [keyOf("P", "B")]: ["one"],
      [keyOf("Q", "B")]: ["one"],
    });
  });

  it("are listed first, then what is open", () => {
    const listed = inOrder({
      a: requirement("satisfied"),
      b: requirement("open"),
      c: requirement("violated"),
      d: requirement("open"),
    });
    expect(listed.map(([name]) => name)).toEqual(["c", "b", "d", "a"]);
  });
});
