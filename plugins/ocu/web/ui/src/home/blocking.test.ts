import { describe, expect, it } from "vitest";
import type { WaitingTask } from "../shared/types";
import { blockedBy, heldFor } from "./blocking";

const waits = (run: string, holders: Record<string, string>): WaitingTask => ({
  run,
  allocation: `${run}.a1`,
  task: "DRIVE",
  waited_s: 3,
  reason: "",
  holders,
});

describe("an incident", () => {
  const incident = { incident: "r1.i1", resources: ["v1", "v1/arm"] };

  it("blocks the tasks that wait for what it holds, and no others", () => {
    const waiting = [
      waits("r2", { v1: "r1.i1" }),
      waits("r3", { v2: "r1.i1", v3: "anna" }),
      waits("r4", { v1: "r9.b1" }),
      waits("r5", { v3: "r8.b1", "v1/arm": "r1.i1" }),
    ];
    expect(blockedBy(incident, waiting).map(({ run }) => run)).toEqual(["r2", "r5"]);
  });

  it("says what it holds, and what waits for that", () => {
    const blocked = [waits("r2", {}), waits("r5", {})];
    expect(heldFor(incident, blocked)).toBe("holds v1, v1/arm; blocks r2, DRIVE; r5, DRIVE");
    expect(heldFor(incident, [])).toBe("holds v1, v1/arm");
    expect(heldFor({ resources: [] }, blocked)).toBe("");
  });
});
