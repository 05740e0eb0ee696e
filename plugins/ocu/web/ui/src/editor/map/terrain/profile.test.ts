import { expect, test } from "vitest";
import { plotOf, type ProfilePoint } from "./profile";

const point = (along_m: number, ground_m: number | null, altitude_m: number | null): ProfilePoint => ({
  along_m,
  latitude_deg: 0,
  longitude_deg: 0,
  ground_m,
  altitude_m,
  above_ground_m: ground_m === null || altitude_m === null ? null : altitude_m - ground_m,
  waypoint: along_m % 100 === 0 ? along_m / 100 : null,
});

test("what is nearer to the ground than the clearance is apart", () => {
  const points = [point(0, 50, 90), point(50, 75, 90), point(100, 50, 90)];
  const profile = { points, lowest: 1, clearance_m: 20, missing: "" };
  const plot = plotOf(profile, 100, 50)!;
  expect(plot.low).toHaveLength(2); // to the hill, and from it
  expect(plot.waypoints.map(([x]) => x)).toEqual([0, 100]);
  expect(plot.range_m).toEqual([50, 90]);
  expect(plotOf({ ...profile, clearance_m: 15 }, 100, 50)!.low).toEqual([]);
});

test("unknown ground and altitudes are left out, and nothing known is no picture", () => {
  const profile = { points: [point(0, 50, null), point(100, null, null)], lowest: null, clearance_m: null, missing: "x" };
  const plot = plotOf(profile, 100, 50)!;
  expect(plot.route).toBe("");
  expect(plot.ground).toMatch(/^0\.0,50 .* 0\.0,50$/);
  expect(plotOf({ ...profile, points: [point(0, null, null)] }, 100, 50)).toBeNull();
});
