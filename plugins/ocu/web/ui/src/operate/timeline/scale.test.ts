import { describe, expect, it } from "vitest";
import { lanes, marks, whole, zoomed } from "./scale";

describe("time line", () => {
  it("shows the whole run", () => {
    expect(whole(100, 1016)).toEqual({ from_s: 0, px_per_s: 10 });
  });

  it("zooms around the mouse", () => {
    const { from_s, px_per_s } = zoomed({ from_s: 10, px_per_s: 10 }, 2, 100);
    expect([from_s, px_per_s]).toEqual([15, 20]);
    expect(zoomed({ from_s: 0, px_per_s: 10 }, 0.5, 100).from_s).toBe(0);
  });

  it("marks round times that have room", () => {
    expect(marks({ from_s: 3, px_per_s: 10 }, 200, 60)).toEqual([10, 20]);
    expect(marks({ from_s: 0, px_per_s: 0.1 }, 200, 60)).toEqual([0, 600, 1200, 1800]);
  });

  it("shows a run of a month whole, with days marked", () => {
    const [month_s, day_s] = [30 * 86_400, 86_400];
    const window = whole(month_s, 716);
    expect(window.px_per_s * month_s).toBeCloseTo(700);
    expect(marks(window, 716, 70)).toEqual([0, 3, 6, 9, 12, 15, 18, 21, 24, 27, 30].map((day) => day * day_s));
  });

  it("puts what overlaps into lanes", () => {
    const bars = lanes([
      { from: 0, to: 5 },
      { from: 5, to: null },
      { from: 2, to: 3 },
      { from: 3, to: 9 },
    ]);
    expect(bars.map(({ span, lane }) => [span.from, lane])).toEqual([
      [0, 0],
      [2, 1],
      [3, 1],
      [5, 0],
    ]);
  });
});
