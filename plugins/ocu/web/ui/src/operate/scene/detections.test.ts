import { describe, expect, it } from "vitest";
import type { Detection } from "../../shared/types";
import { detectionsOf, withDetections } from "./detections";

const detection = (number: number, type = "mine"): Detection => ({
  number,
  t_s: number,
  type,
  source: "ugv1/radar",
  position: { latitude_deg: 38, longitude_deg: -77, altitude_m: 0 },
  time_us: 0,
});

describe("detections of a run", () => {
  it("come from the samples that have some", () => {
    const found = detectionsOf([
      {},
      { detections: [detection(1)] },
      { detections: [detection(2)], more_detections: 3 },
      { more_detections: 4 },
    ]);
    expect(found.all.map(({ number }) => number)).toEqual([1, 2]);
    expect(found.more).toBe(7);
  });

  it("are in order, and a later one replaces the one of its number", () => {
    const first = { all: [detection(2), detection(1)], more: 5 };
    const found = withDetections(first, { all: [detection(2, "man")], more: 0 });
    expect(found.all.map(({ number, type }) => [number, type])).toEqual([
      [1, "mine"],
      [2, "man"],
    ]);
    expect(found.more).toBe(5);
  });
});
