import { describe, expect, it } from "vitest";
import { othersEditing, persons, type Presence } from "./persons";

const at = (by: string, run: string, editing = ""): Presence => ({
  by,
  run,
  unit: "page",
  role: "operator",
  page: "",
  since_us: 0,
  editing,
});

describe("persons", () => {
  it("has one line a person, with the run that one of the pages watches", () => {
    const all = [at("anna", ""), at("anna", "r2"), at("otto", "r1"), at("otto", "")];
    expect(persons(all).map(({ by, run }) => [by, run])).toEqual([
      ["anna", "r2"],
      ["otto", "r1"],
    ]);
  });

  it("takes names with and without a host for one person", () => {
    expect(persons([at("anna@gcs1", ""), at("Anna", "r2")]).map(({ by }) => by)).toEqual(["Anna"]);
  });

  it("says who else edits a mission", () => {
    const all = [at("anna", "", "patrol"), at("otto", "", "patrol"), at("carla", "", "sweep")];
    expect(othersEditing([...all, at("otto", "", "patrol")], "patrol", "anna@gcs1")).toEqual([
      "otto",
    ]);
  });
});
