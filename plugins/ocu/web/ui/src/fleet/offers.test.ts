import { describe, expect, it } from "vitest";
import { inCommon, isComplete, offersOf } from "./offers";
import { vehicle } from "./testing";

describe("behaviors that can be commanded", () => {
  const behavior = (name: string, resources: string[], more: object = {}) => ({
    name,
    type: "vehicle" as const,
    doc: "",
    ends: true,
    writes: [],
    required_one_of: [],
    parameters: [],
    resources,
    teams: [],
    ...more,
  });
  const parameter = (name: string, required: boolean) => ({
    name,
    required,
    kind: "text",
    unit: "",
    minimum: null,
    maximum: null,
    choices: [],
    default: null,
    doc: "",
  });

  it("are those that all offer; of a manned vehicle none", () => {
    const fleet = {
      name: "f",
      origin: { lat: 0, lon: 0, alt: 0 },
      vehicles: [vehicle("v1"), vehicle("v2"), vehicle("m", { manned: true })],
      payloads: [],
      teams: [],
      fence: null,
      approval_persons: 0,
      may_be_debugged: true,
    };
    const offers = offersOf(fleet, [
      behavior("goto", ["v1", "m"]),
      behavior("goto", ["v2"], { doc: "of another arbiter" }),
      behavior("land", ["v2"]),
      behavior("escort", ["v1", "v2"], { type: "team" }),
    ]);
    expect(inCommon(offers, ["v1", "v2"]).map(({ name, doc }) => [name, doc])).toEqual([
      ["goto", ""],
    ]);
    expect(inCommon(offers, ["v2"]).map(({ name }) => name)).toEqual(["goto", "land"]);
    expect(inCommon(offers, ["m"])).toEqual([]);
  });

  it("are complete with what is required, and one whole group", () => {
    const observe = behavior("area_observe", ["v1"], {
      parameters: [parameter("speed", true), parameter("area", false), parameter("target", false)],
      required_one_of: [["area"], ["target"]],
    });
    expect(isComplete(observe, { speed: "2 m/s" })).toBe(false);
    expect(isComplete(observe, { area: "a" })).toBe(false);
    expect(isComplete(observe, { speed: "2 m/s", area: " " })).toBe(false);
    expect(isComplete(observe, { speed: "2 m/s", target: "p" })).toBe(true);
  });
});
