import { expect, it } from "vitest";
import { snapped } from "./snap";

const at = (latitude: number, longitude: number, altitude: number | null = null) => ({
  latitude,
  longitude,
  altitude,
});
const pixelOf = ({ latitude, longitude }: { latitude: number; longitude: number }) => ({
  x: longitude,
  y: latitude,
});

it("goes onto the nearest vertex that is near enough, and keeps its own altitude", () => {
  const others = [at(0, 11, 5), at(0, 8, 5), at(0, 90, 5)];
  expect(snapped(at(0, 0, 40), others, pixelOf)).toEqual(at(0, 8, 40));
});

it("stays where it is when none is near", () => {
  expect(snapped(at(0, 0), [at(9, 9)], pixelOf)).toEqual(at(0, 0));
});
