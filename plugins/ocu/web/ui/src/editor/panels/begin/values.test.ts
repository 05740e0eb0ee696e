import { describe, expect, it } from "vitest";
import { readValue, writtenValue } from "./values";

describe("values that people write", () => {
  it.each([
    ["", "nothing", null],
    ["null", "nothing", null],
    ["true", "yesno", true],
    ["yes", "text", "yes"],
    ["12", "number", 12],
    ["+1.5e3", "number", 1500],
    ["0x1f", "number", 31],
    ["1.5 m/s", "text", "1.5 m/s"],
    ["route_alpha", "text", "route_alpha"],
    ["'12'", "text", "12"],
    ["'it''s'", "text", "it's"],
    ['"a\\nb"', "text", "a\nb"],
    ["[1, 2]", "list", [1, 2]],
    ['{"a": null}', "map", { a: null }],
    ["[1, 2", "unreadable", null],
    ["'open", "unreadable", null],
  ])("%j is %s", (written, kind, value) => {
    expect(readValue(written)).toEqual({ kind, value });
  });

  it("are written so that they are read as the same", () => {
    for (const value of ["12", "true", "null", "go", "a: b", "", "- x", 12, 1.5, true, null, [1]]) {
      expect(readValue(writtenValue(value)).value).toEqual(value);
    }
    expect(writtenValue("go")).toBe("go");
  });
});
