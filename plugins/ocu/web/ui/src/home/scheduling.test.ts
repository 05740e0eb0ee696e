import { describe, expect, it } from "vitest";
import { ApiError } from "../shared/api";
import { dataOf, EMPTY, errorsOf, refusalOf, requestOf, type Form } from "./scheduling";

const WORDS = { needed: "needed", notNumber: "number", notInteger: "integer", notData: "data" };
const FREE: Form = { ...EMPTY, mission: "patrol", kind: "free" };

describe("what is sent", () => {
  it("has only what was filled in", () => {
    expect(requestOf(FREE, "Europe/Berlin")).toEqual({
      mission: "patrol",
      process: null,
      data: {},
      when: { missed: "skip", concurrency: "forbid" },
      priority: 0,
    });
  });

  it("has every field of the schedule", () => {
    const form: Form = {
      mission: "patrol",
      process: "NIGHT",
      data: "speed = 3\nname=a b",
      kind: "at",
      at: "2030-01-01T08:00",
      cron: "",
      until: "2030-01-02T08:00",
      after: "s1",
      outcomes: ["completed", "failed"],
      condition: " vehicle.battery > 0.9 ",
      vehicles: ["ugv1"],
      heldForS: "30",
      deadlineMin: "1.5",
      missed: "run-once",
      concurrency: "allow",
      priority: "5",
    };
    expect(errorsOf(form, WORDS)).toEqual({});
    expect(requestOf(form, "Europe/Berlin")).toEqual({
      mission: "patrol",
      process: "NIGHT",
      data: { speed: 3, name: "a b" },
      when: {
        at: "2030-01-01T08:00",
        until: "2030-01-02T08:00",
        time_zone: "Europe/Berlin",
        after: "s1",
        outcomes: ["completed", "failed"],
        condition: "vehicle.battery > 0.9",
        vehicles: ["ugv1"],
        held_for_s: 30,
        starting_deadline_s: 90,
        missed: "run-once",
        concurrency: "allow",
      },
      priority: 5,
    });
  });

  it("leaves out what goes with a field that is empty", () => {
    const form: Form = { ...FREE, vehicles: ["ugv1"], heldForS: "30", outcomes: ["failed"] };
    expect(requestOf(form, "UTC")).toMatchObject({
      when: { missed: "skip", concurrency: "forbid" },
    });
  });
});

describe("what is wrong", () => {
  it("is said of each field", () => {
    const form: Form = {
      ...EMPTY,
      after: "r1",
      outcomes: [],
      condition: "vehicle.armed",
      heldForS: "-1",
      deadlineMin: "soon",
      priority: "1.5",
      data: "speed",
    };
    expect(errorsOf(form, WORDS)).toEqual({
      mission: "needed",
      at: "needed",
      outcomes: "needed",
      heldForS: "number",
      deadlineMin: "number",
      priority: "integer",
      data: "data",
    });
    expect(errorsOf({ ...FREE, kind: "cron" }, WORDS)).toEqual({ cron: "needed" });
  });

  it("is a name that is given twice", () => {
    expect(dataOf("a=1\na=2")).toBeNull();
    const words = { ...WORDS, notData: "not {line}" };
    const wrongs = ["a=1\na=2", 'a=1\n\n b={"c": 1 ', "speed", "a = 1"].map(
      (data) => errorsOf({ ...EMPTY, data }, words).data,
    );
    expect(wrongs).toEqual(["not a=2", 'not b={"c": 1', "not speed", undefined]);
  });

  it.each([
    [{ field: "starting_deadline_s" }, { errors: { deadlineMin: "no" }, rest: "" }],
    [{ field: "cron" }, { errors: { cron: "no" }, rest: "" }],
    [{ field: "" }, { errors: {}, rest: "no" }],
    [
      { wrong: [{ where: "body.when.vehicles.0", what: "too long" }] },
      { errors: { vehicles: "too long" }, rest: "" },
    ],
    [{ wrong: [{ where: "body.x", what: "odd" }] }, { errors: {}, rest: "body.x: odd" }],
  ])("stands where the server says: %o", (more, expected) => {
    const problem = { type: "", title: "", status: 409, detail: "no", ...more };
    expect(refusalOf(new ApiError(problem))).toEqual(expected);
  });
});
