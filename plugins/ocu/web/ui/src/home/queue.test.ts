import { describe, expect, it } from "vitest";
import type { ScheduledMission, ScheduledStatus } from "../shared/types";
import { inOrder } from "./queue";

const entry = (
  id: string,
  status: ScheduledStatus,
  more: Partial<ScheduledMission> = {},
): ScheduledMission => ({
  entry: id,
  mission: `/missions/${id}.bpmn`,
  process: "",
  when: "",
  time_zone: "",
  status,
  priority: 0,
  by: "anna",
  next_us: null,
  due_us: null,
  deadline_us: null,
  starts_us: null,
  reason: "",
  run: "",
  ...more,
});
const ids = (found: readonly ScheduledMission[]) => found.map((each) => each.entry);
const ALL = { text: "", status: "" } as const;

describe("the schedule", () => {
  it("has the queue first, by priority, then what has a date, then the last that are over", () => {
    const entries = [
      ...["s1", "s2", "s3", "s4"].map((id) => entry(id, "ended")),
      entry("s5", "scheduled", { next_us: 9 }),
      entry("s6", "waiting", { due_us: 2 }),
      entry("s7", "waiting", { due_us: 5, priority: 2 }),
      entry("s8", "waiting", { due_us: 1 }),
      entry("s9", "held", { next_us: 3 }),
    ];
    expect(ids(inOrder(entries, ALL))).toEqual(["s7", "s8", "s6", "s9", "s5", "s2", "s3", "s4"]);
    expect(ids(inOrder(entries, { ...ALL, status: "ended" }))).toEqual(["s1", "s2", "s3", "s4"]);
    expect(ids(inOrder(entries, { ...ALL, status: "waiting" }))).toEqual(["s7", "s8", "s6"]);
  });

  it("is searched by words", () => {
    const entries = [
      entry("s1", "waiting", { reason: "uav1 is with otto" }),
      entry("s2", "waiting", { mission: "Survey.bpmn" }),
    ];
    expect(ids(inOrder(entries, { ...ALL, text: "OTTO uav1" }))).toEqual(["s1"]);
    expect(ids(inOrder(entries, { ...ALL, text: "survey" }))).toEqual(["s2"]);
    expect(ids(inOrder(entries, { ...ALL, text: "nothing like it" }))).toEqual([]);
  });
});
