import { describe, expect, it } from "vitest";
import { completeFormula, type Vocabulary } from "./completion";
import { PATTERNS, patternNamed, scopesOf } from "./patterns";

const vocabulary: Vocabulary = {
  elements: [
    { id: "Drive", name: "DRIVE ROUTE", type: "scriptTask" },
    { id: "Ask", name: "", type: "userTask" },
  ],
  resources: ["uav1", "evsg2/ptz"],
  behaviors: ["goto", "area_survey"],
  names: [{ name: "user.decision", from: "Ask" }],
  decided: [{ store: "user.decision", values: [{ value: "go", label: "Go on" }] }],
};

/** `|` stands for the cursor. */
function offered(text: string, isCondition = false) {
  const cursor = text.indexOf("|");
  const { from, options } = completeFormula(text.replace("|", ""), cursor, vocabulary, isCondition);
  return { typed: text.slice(from, cursor), values: options.map(({ value }) => value) };
}

describe("what may come next in a formula", () => {
  it("is an element, by id or by its name in quotes", () => {
    expect(offered("[](active(dr|")).toEqual({ typed: "dr", values: ["Drive)"] });
    expect(offered("completed('|")).toEqual({ typed: "", values: ["DRIVE ROUTE')"] });
  });

  it("is who is commanded, and to do what", () => {
    expect(offered("commanded(|").values).toEqual(["uav1", "evsg2/ptz"]);
    expect(offered("commanded(evsg2/p|")).toEqual({ typed: "evsg2/p", values: ["evsg2/ptz"] });
    expect(offered("commanded(uav1, a|")).toEqual({ typed: "a", values: ["area_survey)"] });
  });

  it("is a decision that an operator can take", () => {
    expect(offered("user.decision == |")).toEqual({ typed: "", values: ["'go'"] });
    expect(offered("user.decision == 'g|")).toEqual({ typed: "'g", values: ["'go'"] });
  });

  it("is how a run ends", () => {
    expect(offered("<> ended(f|").values).toEqual(["failed)"]);
  });

  it("is an operator after what can be joined, and an operand after an operator", () => {
    expect(offered("active(Drive) |").values).toEqual([
      "-> ",
      "&& ",
      "|| ",
      "<-> ",
      "U ",
      "W ",
      "since ",
    ]);
    expect(offered("user.decision |").values).toContain("== ");
    expect(offered("active(Drive) U |").values).toContain("completed(");
  });

  it("is an element alone only where that stands for its completion", () => {
    expect(offered("Dr|", true).values).toEqual(["Drive"]);
    expect(offered("|").values).not.toContain("Drive");
    expect(offered("[] Dr|", true).values).toEqual([]);
  });

  it("is nothing when all of it stands there", () => {
    expect(offered("user.decision|").values).toEqual([]);
  });
});

describe("patterns", () => {
  it("have names of their own, and say what they need", () => {
    expect(new Set(PATTERNS.map(({ name }) => name)).size).toBe(PATTERNS.length);
    expect(PATTERNS.every(({ meaning }) => meaning !== "")).toBe(true);
  });

  it("take parts of the run that they do not use themselves", () => {
    const names = (name: string) => scopesOf(patternNamed(name)!).map((each) => each.name);
    expect(names("response")).toEqual(["after", "before", "until"]);
    expect(names("operator_in_the_loop")).not.toContain("before");
    expect(names("wait")).toEqual([]);
  });
});
