import { describe, expect, it } from "vitest";
import { TrailPoints } from "./trailPoints";

const LONGEST_S = 5;
const METRES_PER_PX = 10;

describe("a trail", () => {
  it("goes on from its last point, and not where the vehicle stands", () => {
    const trail = new TrailPoints(100);
    expect(trail.extend([0, 0], METRES_PER_PX, 0, LONGEST_S)).toBeNull();
    expect(trail.extend([1, 0], METRES_PER_PX, 0.2, LONGEST_S)).toEqual([0, 0]);
    expect(trail.extend([1.05, 0], METRES_PER_PX, 0.2, LONGEST_S)).toBeNull();
    expect(trail.extend([2, 0], METRES_PER_PX, 0.2, LONGEST_S)).toEqual([1, 0]);
    expect(trail.pieces).toEqual([[0, 0, 1, 0, 2, 0]]);
  });

  it("is cut where nothing is known", () => {
    const trail = new TrailPoints(100);
    trail.replace([[[0, 0], [1, 0]], []]);
    expect(trail.extend([5, 0], METRES_PER_PX, 60, LONGEST_S)).toBeNull();
    expect(trail.extend([6, 0], METRES_PER_PX, 0.2, LONGEST_S)).toEqual([5, 0]);
    expect(trail.pieces).toEqual([[0, 0, 1, 0], [5, 0, 6, 0]]);
  });

  it("loses its oldest points, across pieces", () => {
    const trail = new TrailPoints(8);
    trail.replace([[[0, 0], [1, 0]], [[2, 0], [3, 0], [4, 0], [5, 0], [6, 0], [7, 0]]]);
    expect(trail.trim()).toBe(false);
    trail.extend([8, 0], METRES_PER_PX, 0.2, LONGEST_S);
    expect(trail.trim()).toBe(true);
    expect(trail.pieces).toEqual([[3, 0, 4, 0, 5, 0, 6, 0, 7, 0, 8, 0]]);
    expect(trail.trim()).toBe(false);
  });
});
