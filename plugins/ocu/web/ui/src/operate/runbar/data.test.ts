import { describe, expect, it } from "vitest";
import { dataOf } from "./data";

describe("data of a signal", () => {
  it("is a JSON object, or nothing", () => {
    expect(dataOf(' {"a": 1} ')).toEqual({ a: 1 });
    expect(dataOf("  ")).toEqual({});
  });

  it("is nothing else", () => {
    expect(["[1]", "null", "3", "{a: 1}", '{"a"'].map(dataOf)).toEqual([
      null,
      null,
      null,
      null,
      null,
    ]);
  });
});
