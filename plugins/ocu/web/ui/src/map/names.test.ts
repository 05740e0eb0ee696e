import { describe, expect, it } from "vitest";
import { roomFor } from "./names";

const named = (x: number, y: number, width = 40) => ({ x, y, width });

describe("names on a map", () => {
  it("are left out where another one is, the first ones stay", () => {
    const [first, over, beside, below] = [named(0, 0), named(30, 5), named(41, 0), named(0, 15)];
    expect(roomFor([first, over, beside, below])).toEqual([first, beside, below]);
    expect(roomFor([over, first])).toEqual([over]);
  });

  it("are told apart across the cells in which they are looked for", () => {
    const [left, right] = [named(60, 60), named(70, 70)];
    expect(roomFor([left, right])).toEqual([left]);
    expect(roomFor([named(-5, -5), named(5, 5)])).toHaveLength(1);
  });

  it("of a thousand vehicles never overlap", () => {
    const all = Array.from({ length: 1000 }, (_, index) =>
      named((index * 37) % 500, (index * 91) % 240, 30),
    );
    const shown = roomFor(all);
    const clash = shown.some((one, index) =>
      shown
        .slice(index + 1)
        .some((other) => Math.abs(one.x - other.x) < 30 && Math.abs(one.y - other.y) < 14),
    );
    expect(clash).toBe(false);
    expect(shown.length).toBeGreaterThan(50);
  });
});
