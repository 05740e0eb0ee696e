import { describe, expect, it } from "vitest";
import type { Outline } from "../../../shared/types";
import { Beginning, problemOf, wanted } from "./beginning";

const outline = {
  names: [
    { name: "user.decision", from: "Ask" },
    { name: "speed", from: "" },
    { name: "detection.type", from: "" },
    { name: "detection.type", from: "Detector" },
  ],
} as Outline;

describe("what a run begins with", () => {
  it("has typed values, and leaves out what was not filled in", () => {
    const beginning = new Beginning();
    expect(beginning.request()).toEqual({});
    beginning.process.value = "PATROL";
    beginning.given.value = [
      { name: " speed ", written: "1.5" },
      { name: "", written: "" },
      { name: "route", written: "alpha" },
    ];
    expect(beginning.request()).toEqual({
      process: "PATROL",
      data: { speed: 1.5, route: "alpha" },
    });
    expect(beginning.isReadable()).toBe(true);
  });

  it("says what cannot be read", () => {
    const rows = [
      { name: "a", written: "1" },
      { name: "a", written: "2" },
      { name: "b c", written: "1" },
      { name: "", written: "1" },
      { name: "d", written: "[1" },
    ];
    const problems = rows.map((_, index) => problemOf(rows, index));
    expect(problems).toEqual([undefined, "twice", "name", "name", "value"]);
  });

  it("offers what the mission reads and nothing writes", () => {
    expect(wanted(outline, [])).toEqual(["speed"]);
    expect(wanted(outline, [{ name: "speed", written: "" }])).toEqual([]);
  });
});
