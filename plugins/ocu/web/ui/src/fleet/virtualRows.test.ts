import { describe, expect, it } from "vitest";
import { scrolledTo, windowOf } from "./virtualRows";

describe("a table of many lines", () => {
  const view = { line_px: 30, seen_px: 300 };
  it("draws what is seen, and a few around", () => {
    expect(windowOf(1000, { ...view, scrolled_px: 0 })).toEqual({ from: 0, to: 18 });
    expect(windowOf(1000, { ...view, scrolled_px: 15_000 })).toEqual({ from: 492, to: 518 });
    expect(windowOf(5, { ...view, scrolled_px: 15_000 })).toEqual({ from: 5, to: 5 });
  });

  it("scrolls no further than to show a line", () => {
    const seen = { ...view, head_px: 30 };
    expect(scrolledTo(2, { ...seen, scrolled_px: 300 })).toBe(60);
    expect(scrolledTo(12, { ...seen, scrolled_px: 300 })).toBe(300);
    expect(scrolledTo(30, { ...seen, scrolled_px: 300 })).toBe(660);
  });
});
