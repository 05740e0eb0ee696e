import { describe, expect, it } from "vitest";
import { complete, type Decided } from "./completion";
import type { Dialect, DialectName } from "./dialect";

const names = [
  { name: "user.decision", from: "UserSendRoute" },
  { name: "detection.type", from: "Detector" },
  { name: "mission.speed", from: "data object" },
];
const decided: Decided[] = [
  {
    store: "user.decision",
    values: [
      { value: "continue", label: "Continue" },
      { value: "abort", label: "abort" },
    ],
  },
];

const dialect: Dialect = {
  functions: [
    { name: "round", signatures: ["round(x)"], doc: "the nearest integer" },
    { name: "string join", signatures: ["string join(list, delimiter?)"], doc: "one text" },
    { name: "string length", signatures: ["string length(string)"], doc: "characters" },
  ],
  words: ["and", "true"],
  operators: ["==", "<", "and"],
};
const offered = (text: string, name: DialectName = "m2pem") =>
  complete(text, text.length, names, decided, name, dialect);
const values = (text: string, name?: DialectName) =>
  offered(text, name).options.map(({ value }) => value);

describe("what is offered in a condition", () => {
  it("is every name at its beginning", () => {
    expect(values("")).toEqual(["user.decision", "detection.type", "mission.speed"]);
  });

  it("is names with what has been typed in them, in place of it", () => {
    expect(offered("not det")).toMatchObject({ from: 4, options: [{ value: "detection.type" }] });
    expect(values("${type")).toEqual(["detection.type"]);
    expect(values("mission.speed")).toEqual([]);
  });

  it("is functions and constants once they are begun", () => {
    expect(values("ro")).toEqual(["round("]);
    expect(values("tr")).toEqual(["true"]);
    expect(offered("1 < ro").options).toEqual([
      { value: "round(", note: "(x)", doc: "the nearest integer", group: "functions" },
    ]);
  });

  it("is the rest of a function's name that has several words", () => {
    expect(offered("= 1 < string le", "feel")).toMatchObject({
      from: 6,
      options: [{ value: "string length(" }],
    });
    expect(values("= string ", "feel")).toEqual(["string join(", "string length("]);
    expect(values("mission.speed ")).toContain("== ");
  });

  it("is what reads a name in XPath, and texts as FEEL writes them", () => {
    expect(values("det", "xpath")).toEqual(["getDataObject('detection.type')"]);
    expect(values("= user.decision = ", "feel")).toEqual(['"continue"', '"abort"']);
  });

  it("is operators after a name, a value or a bracket", () => {
    for (const text of ["mission.speed ", "'a' ", "(1) ", "5 "]) {
      expect(values(text)).toContain("== ");
    }
    expect(values("a == 1 and ")).toContain("mission.speed");
  });

  it("is the decisions of the prompts that write the name which is compared", () => {
    expect(values("user.decision == ")).toEqual(["'continue'", "'abort'"]);
    expect(offered("user.decision != 'co")).toEqual({
      from: 17,
      options: [{ value: "'continue'", note: "Continue", group: "values" }],
    });
    expect(values('= user.decision = "ab')).toEqual(['"abort"']);
    expect(values("user.decision ==")).toEqual(["'continue'", "'abort'"]);
  });

  it("is nothing inside any other text", () => {
    expect(values("detection.type == 'gp")).toEqual([]);
    expect(values("detection.type == 'g p' and user.decision == ")).toContain("'abort'");
  });

  it("is nothing right behind a value", () => {
    for (const text of ["user.decision == 'abort'", "(a)", "a == 5"])
      expect(values(text)).toEqual([]);
  });

  it("looks at what stands before the cursor only", () => {
    expect(complete("det == 1", 3, names, decided, "m2pem", dialect).options[0]?.value).toBe("detection.type");
  });
});
