import { describe, expect, it } from "vitest";
import type { Parameter } from "../../shared/types";
import { defaultOf, examine, written } from "./quantities";

const parameter = (more: Partial<Parameter>): Parameter => ({
  name: "p",
  kind: "distance",
  unit: "m",
  required: false,
  minimum: null,
  maximum: null,
  choices: [],
  default: null,
  doc: "",
  ...more,
});

describe("values of parameters", () => {
  it("may be left out unless they are required", () => {
    expect(examine(parameter({}), " ")).toBeUndefined();
    expect(examine(parameter({ required: true }), "")).toEqual({ problem: "required" });
  });

  it("may be expressions, whatever they are for", () => {
    for (const value of ["${mission.speed}", "= mission.speed * 2"]) {
      expect(examine(parameter({ kind: "speed", maximum: 1 }), value)).toBeUndefined();
    }
  });

  it("carry units of their kind", () => {
    expect(examine(parameter({}), "5 km")).toBeUndefined();
    expect(examine(parameter({}), "5")).toBeUndefined();
    expect(examine(parameter({}), "5 s")).toMatchObject({ problem: "unit", unit: "s" });
    expect(examine(parameter({ kind: "angle" }), "45")).toMatchObject({
      problem: "unit",
      unit: "",
    });
    expect(examine(parameter({ kind: "angle" }), "45 deg")).toBeUndefined();
    expect(examine(parameter({}), "far")).toEqual({ problem: "number" });
    expect(examine(parameter({ kind: "number" }), "5 m")).toMatchObject({ problem: "unit" });
  });

  it("stay within their bounds, which are inclusive", () => {
    const sector = parameter({ kind: "angle", minimum: 0, maximum: 2 * Math.PI });
    expect(examine(sector, "360 deg")).toBeUndefined();
    expect(examine(sector, "361 deg")).toEqual({ problem: "most", bound: "360 deg" });
    expect(examine(sector, "-1 deg")).toEqual({ problem: "least", bound: "0 deg" });
  });

  it("are whole numbers where something is counted, and choices where there are some", () => {
    expect(examine(parameter({ kind: "count" }), "2.5")).toEqual({ problem: "whole" });
    const frame = parameter({ kind: "text", choices: ["amsl", "terrain"] });
    expect(examine(frame, "amsl")).toBeUndefined();
    expect(examine(frame, "sea")).toMatchObject({ problem: "choice" });
    expect(examine(parameter({ kind: "route" }), "route_alpha")).toBeUndefined();
  });

  it("are written with the unit that people mean", () => {
    expect(written("angular_speed", Math.PI / 18)).toBe("10 deg/s");
    expect(defaultOf(parameter({ default: 5 }))).toBe("5 m");
    expect(defaultOf(parameter({ kind: "boolean", default: true }))).toBe("true");
    expect(defaultOf(parameter({}))).toBe("");
  });
});
