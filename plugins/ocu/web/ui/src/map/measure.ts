// Lengths and areas on the ground. The sphere is good enough over a few kilometres.
import type { Vertex } from "./draft";
import { locale } from "../strings/language";

const EARTH_M = 6_371_008.8;
const RAD = Math.PI / 180;

type Place = Pick<Vertex, "latitude" | "longitude">;

export function distance_m(one: Place, other: Place): number {
  const north = Math.sin(((other.latitude - one.latitude) * RAD) / 2) ** 2;
  const east = Math.sin(((other.longitude - one.longitude) * RAD) / 2) ** 2;
  const cosines = Math.cos(one.latitude * RAD) * Math.cos(other.latitude * RAD);
  return 2 * EARTH_M * Math.asin(Math.sqrt(north + cosines * east));
}

/** Of each leg in order; `closed`: with that from the last vertex to the first. */
export function legs_m(vertices: readonly Place[], closed: boolean): number[] {
  const ends = closed && vertices.length > 2 ? [...vertices.slice(1), vertices[0]!] : vertices.slice(1);
  return ends.map((end, index) => distance_m(vertices[index]!, end));
}

export const length_m = (vertices: readonly Place[], closed: boolean): number =>
  legs_m(vertices, closed).reduce((sum, each) => sum + each, 0);

/** Of the polygon of these corners. */
export function area_m2(vertices: readonly Place[]): number {
  const [first] = vertices;
  if (!first || vertices.length < 3) return 0;
  const middle = vertices.reduce((sum, each) => sum + each.latitude, 0) / vertices.length;
  const flat = vertices.map(({ latitude, longitude }) => [
    (longitude - first.longitude) * RAD * EARTH_M * Math.cos(middle * RAD),
    (latitude - first.latitude) * RAD * EARTH_M,
  ]);
  const twice = flat.reduce((sum, [x = 0, y = 0], index) => {
    const [nextX = 0, nextY = 0] = flat[(index + 1) % flat.length]!;
    return sum + x * nextY - nextX * y;
  }, 0);
  return Math.abs(twice) / 2;
}

export function middleOf(vertices: readonly Place[]): Place {
  const sum = (of: (each: Place) => number) =>
    vertices.reduce((total, each) => total + of(each), 0) / Math.max(1, vertices.length);
  return { latitude: sum((each) => each.latitude), longitude: sum((each) => each.longitude) };
}

const figures = (value: number, decimals: number): string =>
  value.toLocaleString(locale, { maximumFractionDigits: decimals });

/** `85 m`, `1.25 km`. */
export const writtenLength = (metres: number): string =>
  metres < 1000 ? `${figures(metres, metres < 10 ? 1 : 0)} m` : `${figures(metres / 1000, 2)} km`;

/** `850 m²`, `1.2 ha`, `3.4 km²`. */
export function writtenArea(square_m: number): string {
  if (square_m < 10_000) return `${figures(square_m, 0)} m²`;
  if (square_m < 1_000_000) return `${figures(square_m / 10_000, 2)} ha`;
  return `${figures(square_m / 1_000_000, 2)} km²`;
}
