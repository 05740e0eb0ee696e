import { describe, expect, it } from "vitest";
import { longestStep_s, pieces } from "./trail";

const at = (t: number, metres: number) => ({
  t,
  position: { latitude_deg: 38 + metres / 111_195, longitude_deg: -77 },
});
const lengths = (...places: ReturnType<typeof at>[]) =>
  pieces(places, longestStep_s(places)).map((piece) => piece.length);

describe("a trail", () => {
  it("is whole while states come", () => {
    expect(lengths(at(0, 0), at(1, 2), at(2, 4), at(3, 6))).toEqual([4]);
  });

  it("is cut where nothing is known of the way", () => {
    expect(lengths(at(0, 0), at(1, 2), at(2, 4), at(20, 60), at(21, 62))).toEqual([3, 2]);
  });

  it("is whole where the vehicle stood", () => {
    expect(lengths(at(0, 0), at(1, 2), at(60, 3), at(61, 5))).toEqual([4]);
  });

  it("knows a track that was thinned", () => {
    expect(lengths(at(0, 0), at(8, 16), at(16, 32), at(24, 48), at(90, 200))).toEqual([4, 1]);
  });
});
