import { describe, expect, it } from "vitest";
import { choicesWith, needsConfirmation, vehiclesFirst, type Plan, type Refusal } from "./plan";

const PLAN: Plan = {
  plan: "p",
  version: "new",
  previous: "old",
  possible: false,
  changes: [],
  effects: [],
  refusals: [],
  findings: [],
  outlook: null,
  approval: "",
  busy: [],
};

const refusal = (
  element: string,
  token: number,
  candidates: string[],
  can_end = candidates.length > 0,
): Refusal => ({
  element,
  token,
  text: `a token is on ${element}`,
  candidates,
  labels: candidates.map((id) => `task ${id}`),
  resources: [],
  can_end,
});

describe("the plan of a revision", () => {
  it("says first what concerns vehicles", () => {
    const effects = [
      { text: "a", resources: [] },
      { text: "b", resources: ["uav1"] },
      { text: "c", resources: [] },
      { text: "d", resources: ["uav2"] },
    ];
    expect(vehiclesFirst(effects).map(({ text }) => text)).toEqual(["b", "d", "a", "c"]);
  });

  it("offers a choice for each element with tokens that can go elsewhere", () => {
    const plan = { ...PLAN, refusals: [refusal("Fly", 1, ["Land"]), refusal("Fly", 2, ["Land"])] };
    expect(choicesWith([], plan)).toEqual([
      { element: "Fly", targets: [{ id: "Land", label: "task Land" }], canEnd: true },
    ]);
  });

  it("offers a token that can go nowhere to end, where it can", () => {
    const plan = { ...PLAN, refusals: [refusal("Handle", 4, [], true)] };
    expect(choicesWith([], plan)).toEqual([{ element: "Handle", targets: [], canEnd: true }]);
  });

  it("offers none where no token can go elsewhere", () => {
    const plan = { ...PLAN, refusals: [refusal("Undo", 1, []), refusal("Process", 0, [])] };
    expect(choicesWith([], plan)).toEqual([]);
  });

  it("keeps the choices that were made when the next plan refuses them no more", () => {
    const known = [
      { element: "Fly", targets: [{ id: "Land", label: "task Land" }], canEnd: true },
    ];
    const plan = { ...PLAN, refusals: [refusal("Look", 3, ["Land"])] };
    expect(choicesWith(known, plan).map(({ element }) => element)).toEqual(["Fly", "Look"]);
  });

  it("wants a confirmation where the mission cannot complete, and only there", () => {
    const verdict = (name: string) => ({
      ...PLAN,
      outlook: { verdict: name, reason: "", text: name, requirements: [] },
    });
    expect(needsConfirmation(verdict("cannot complete"))).toBe(true);
    expect(needsConfirmation(verdict("may not complete"))).toBe(false);
    expect(needsConfirmation(PLAN)).toBe(false);
  });
});
