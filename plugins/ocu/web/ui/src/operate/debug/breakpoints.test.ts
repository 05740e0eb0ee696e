import { describe, expect, it } from "vitest";
import type { Debugging, Reached } from "../../shared/types";
import type { MissionNode } from "../mission/missionModel";
import { keyOf } from "../mission/names";
import { marksIn, placesOf, signOf, turned } from "./breakpoints";
import { valueOf } from "./values";

const node = (process: string, id: string, type = "Task") => ({ process, id, type }) as MissionNode;

const NODES: Record<string, MissionNode[]> = {
  A: [node("P", "A")],
  P: [node("P", "P", "Process")],
};

const mission = { nodesOf: (id: string) => NODES[id] ?? [] };

const stop = (element: string): Reached => ({
  reason: "breakpoint",
  condition: "",
  process: "P",
  element,
  token: 1,
  scope: 1,
  instance: null,
  within: [],
  resources: [],
});

const debugging = (elements: string[], reached: Reached | null = null): Debugging => ({
  elements,
  conditions: [],
  stepping: false,
  reached,
});

describe("breakpoints of a run", () => {
  it("mark their elements, and the one before which the run is stopped", () => {
    expect(marksIn(null, mission).size).toBe(0);
    expect(Object.fromEntries(marksIn(debugging(["A", "Gone", "P"]), mission))).toEqual({
      [keyOf("P", "A")]: { breakpoint: true, next: false },
    });
    expect(Object.fromEntries(marksIn(debugging(["A"], stop("A")), mission))).toEqual({
      [keyOf("P", "A")]: { breakpoint: true, next: true },
    });
    expect(Object.fromEntries(marksIn(debugging(["A"], stop("B")), mission))).toEqual({
      [keyOf("P", "A")]: { breakpoint: true, next: false },
      [keyOf("P", "B")]: { breakpoint: false, next: true },
    });
    expect(marksIn(debugging([], stop("")), mission).size).toBe(0);
  });

  it("have different signs", () => {
    const signs = [
      signOf(undefined),
      signOf({ breakpoint: true, next: false }),
      signOf({ breakpoint: true, next: true }),
    ];
    expect(new Set(signs).size).toBe(3);
  });

  it("are at elements, not at processes", () => {
    expect(placesOf(["P", "A"], mission)).toEqual([node("P", "A")]);
  });

  it("are set and removed again", () => {
    expect(turned(["A"], "B")).toEqual(["A", "B"]);
    expect(turned(["A", "B"], "A")).toEqual(["B"]);
  });
});

describe("a value that is typed", () => {
  it("is JSON", () => {
    expect(['"north"', "3", "[1]", "null", "false"].map(valueOf)).toEqual([
      "north",
      3,
      [1],
      null,
      false,
    ]);
  });

  it("is nothing else", () => {
    expect(["north", "", "{a: 1}", "3 m"].map(valueOf)).toEqual(Array(4).fill(undefined));
  });
});
