import { describe, expect, it } from "vitest";
import type { Command, WaitingTask } from "../../shared/types";
import { heldElsewhere, isOperator, runOf, waitersOf, workOf } from "./work";

const command = (name: string, since: number, ...resources: string[]): Command => ({
  name,
  since,
  resources,
  process: "P",
  element: name,
});

describe("work", () => {
  it("is what holds a vehicle", () => {
    const commands = {
      b1: command("late", 5, "v1"),
      b2: command("early", 1, "v1", "v2"),
      b3: command("other", 0, "v2"),
    };
    expect(workOf("v1", commands).map(({ behavior }) => behavior)).toEqual(["b2", "b1"]);
  });

  it("tells operators from behaviors", () => {
    const runs = ["r1.b3", "", "r12.a144", "r1.i1", "r2.k1"];
    expect(runs.filter(isOperator)).toEqual([]);
    expect(["anna@gcs1", "anna"].map(isOperator)).toEqual([true, true]);
  });

  it("knows the run that drives a vehicle, whichever page it is shown on", () => {
    expect(["r12.b144", "r2.a1", "anna@gcs1", ""].map(runOf)).toEqual(["r12", "r2", "", ""]);
    expect(["r3.k1", "r4.i2"].map(runOf)).toEqual(["r3", "r4"]);
  });

  it("says who else has a vehicle", () => {
    const labels = { "r12.b144": "DRIVE of r12", "r1.b2": "SCAN of r1", "r3.b1": "LOOK of r3" };
    const said = ["r12.b144", "r1.b2", "anna@gcs1", "", "r5.b1"].map((each) =>
      heldElsewhere("v1", each, "r1", labels),
    );
    expect(said).toEqual([
      "vehicle of another run: r12, DRIVE",
      "",
      "with anna@gcs1",
      "",
      "vehicle of another run: r5",
    ]);
    expect(heldElsewhere("v1/camera", "r3.b1", "r1", labels)).toBe(
      "payload of another run: r3, LOOK",
    );
  });

  it("says which tasks wait for a vehicle, and how many more", () => {
    const waiting = [1, 2, 3, 4].map((number) => ({
      run: `r${number}`,
      task: "DRIVE",
      holders: { [number < 4 ? "v1" : "v2"]: "r9.b1" },
    })) as unknown as WaitingTask[];
    expect(waitersOf("v1", waiting)).toBe("awaited by r1, DRIVE; r2, DRIVE; 1 more");
    expect(waitersOf("v2", waiting)).toBe("awaited by r4, DRIVE");
    expect(waitersOf("v3", waiting)).toBe("");
  });

  it("says what a run has that commands nothing now, its own run, too", () => {
    expect(["r1.k1", "r2.k1", "r1.i3"].map((each) => heldElsewhere("v1", each, "r1", {}))).toEqual([
      "kept by run r1 between tasks",
      "kept by run r2 between tasks",
      "held for incident r1.i3",
    ]);
  });
});
