import { describe, expect, it } from "vitest";
import { area_m2, distance_m, legs_m, length_m, writtenArea, writtenLength } from "./measure";

const at = (latitude: number, longitude: number) => ({ latitude, longitude });
const SQUARE = [at(0, 0), at(0, 0.001), at(0.001, 0.001), at(0.001, 0)];

describe("measures", () => {
  it("knows a degree of latitude, and that of longitude at 60° is half of it", () => {
    expect(distance_m(at(59.5, 7), at(60.5, 7))).toBeCloseTo(111_195, 0);
    expect(distance_m(at(60, 7), at(60, 7.01)) / distance_m(at(0, 7), at(0, 7.01))).toBeCloseTo(0.5, 3);
  });

  it("has the leg that closes an area, and none for a single vertex", () => {
    expect(legs_m(SQUARE, true)).toHaveLength(4);
    expect(legs_m(SQUARE, false)).toHaveLength(3);
    expect(legs_m([at(1, 1)], true)).toEqual([]);
    expect(length_m(SQUARE, true)).toBeCloseTo(444.78, 1);
  });

  it("has an area whichever way round it is drawn", () => {
    expect(area_m2(SQUARE)).toBeCloseTo(12_364, 0);
    expect(area_m2([...SQUARE].reverse())).toBeCloseTo(12_364, 0);
    expect(area_m2(SQUARE.slice(0, 2))).toBe(0);
  });

  it("is written as people write it", () => {
    expect([4.24, 85.4, 1254].map(writtenLength)).toEqual(["4.2 m", "85 m", "1.25 km"]);
    expect([850, 12_345, 3_400_000].map(writtenArea)).toEqual(["850 m²", "1.23 ha", "3.4 km²"]);
  });
});
