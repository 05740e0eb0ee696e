import { describe, expect, it } from "vitest";
import type { Command } from "../../shared/types";
import { heldElsewhere, isOperator, runOf, workOf } from "./work";

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
    const said = ["r12.b144", "r1.b2", "anna@gcs1", ""].map((each) => heldElsewhere(each, "r1"));
    expect(said).toEqual(["driven by run r12", "", "with anna@gcs1", ""]);
  });

  it("says what a run has that commands nothing now, its own run, too", () => {
    expect(["r1.k1", "r2.k1", "r1.i3"].map((each) => heldElsewhere(each, "r1"))).toEqual([
      "kept by run r1 between tasks",
      "kept by run r2 between tasks",
      "held for incident r1.i3",
    ]);
  });
});
