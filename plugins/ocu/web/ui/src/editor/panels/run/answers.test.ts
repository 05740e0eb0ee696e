import { describe, expect, it } from "vitest";
import { dataOf, EMPTY, isComplete, yamlOf, type Script } from "./answers";

const script: Script = {
  answers: {
    UserSendRoute: [
      { decision: "continue", after: "" },
      { decision: "no way", after: "2.5" },
    ],
    Unused: [],
  },
  services: [
    { element: "Detector", after: "5", name: "detection.type", value: "gpr", error: "" },
    { element: "Detector", after: "", name: "", value: "", error: "SENSOR_BROKEN" },
  ],
  behaviors: [
    { element: "DriveRoute", after: "30", factor: "2", end: "failed", error: "ROUTE_BLOCKED" },
    { element: "DriveStop", after: "9", factor: "", end: "stalled", error: "ignored" },
    { element: "DriveStop", after: "left", factor: "", end: "simulated", error: "" },
    { element: "DriveStop", after: "", factor: "1.25", end: "simulated", error: "" },
  ],
  sends: [
    { kind: "signal", id: "dc45ff2b-ef6b", at: "12.5", data: "reason = dust, depth = 2" },
    { kind: "message", id: "7c1e4a90-2f53", at: "0", data: "" },
  ],
  more: "wind: {speed: 6 m/s}\n",
};

describe("an answers file", () => {
  it("says what the rows say", () => {
    expect(yamlOf(script)).toBe(`answers:
  UserSendRoute: [continue, {decision: "no way", after: 2.5 s}]
services:
  Detector:
    - {after: 5 s, write: {detection.type: gpr}}
    - {error: SENSOR_BROKEN}
behaviors:
  DriveRoute:
    - {after: 30 s, end: failed, error: ROUTE_BLOCKED}
  DriveStop:
    - {after: 9 s, end: stalled}
    - {end: simulated}
    - {end: simulated, factor: 1.25}
signals:
  - {at: 12.5 s, id: dc45ff2b-ef6b, data: {reason: dust, depth: 2}}
messages:
  - {at: 0 s, id: "7c1e4a90-2f53"}
wind: {speed: 6 m/s}
`);
  });

  it("is empty where nothing is scripted", () => {
    expect(yamlOf(EMPTY)).toBe("");
  });

  it("waits for rows that are not filled in", () => {
    expect(isComplete(script)).toBe(true);
    const [send] = script.sends;
    expect(isComplete({ ...script, sends: [{ ...send!, at: "" }] })).toBe(false);
    expect(isComplete({ ...script, sends: [{ ...send!, data: "dust" }] })).toBe(false);
    for (const after of ["soon", ""]) {
      const behaviors = [{ ...script.behaviors[0]!, after }];
      expect(isComplete({ ...script, behaviors })).toBe(false);
    }
    for (const factor of ["0", "-1", "twice"]) {
      const behaviors = [{ ...script.behaviors[0]!, end: "simulated" as const, factor }];
      expect(isComplete({ ...script, behaviors })).toBe(false);
    }
    const answers = { Ask: [{ decision: "go", after: "soon" }] };
    expect(isComplete({ ...script, answers })).toBe(false);
  });
});

it("reads what is sent along", () => {
  expect(dataOf("a = 1, b.c = x")).toEqual({ a: 1, "b.c": "x" });
  expect(dataOf("a")).toBeUndefined();
});
