import { describe, expect, it } from "vitest";
import { persons, type Presence } from "./persons";

const at = (by: string, run: string): Presence => ({
  by,
  run,
  unit: "page",
  role: "operator",
  page: "",
  since_us: 0,
});

describe("persons", () => {
  it("has one line a person, with the run that one of the pages watches", () => {
    const all = [at("anna", ""), at("anna", "r2"), at("otto", "r1"), at("otto", "")];
    expect(persons(all).map(({ by, run }) => [by, run])).toEqual([
      ["anna", "r2"],
      ["otto", "r1"],
    ]);
  });
});
