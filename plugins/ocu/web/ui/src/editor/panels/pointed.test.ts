import { describe, expect, it } from "vitest";
import { pointedAt, scalarIn } from "./pointed";

describe("the place that a message means", () => {
  it("is a column of the formula, or of one of its lines", () => {
    expect(pointedAt("there is no 'activ(...)' at column 4", "[](activ(A))")).toEqual({
      line: "[](activ(A))",
      column: 3,
    });
    expect(pointedAt("bad at column 2 of line 2 of the formula", "[]\n (x")).toEqual({
      line: " (x",
      column: 1,
    });
  });

  it("is nowhere when the message tells none, or one that the formula does not have", () => {
    expect(pointedAt("the mission has no element 'A'", "A")).toBeUndefined();
    expect(pointedAt("bad at column 9", "A")).toBeUndefined();
  });
});

it("finds a formula in a line of YAML", () => {
  expect(scalarIn("    ltl: '[](a -> b''s)'", "ltl")).toBe("[](a -> b's)");
  expect(scalarIn('  - {id: x, ltl: "<> \\"a\\"", text: t}', "ltl")).toBe('<> "a"');
  expect(scalarIn("    ltl: <> ended # in the end", "ltl")).toBe("<> ended");
  expect(scalarIn("  - id: x", "ltl")).toBeUndefined();
});
