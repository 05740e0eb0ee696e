// Where a vehicle has been, in pieces: between two of them nothing is known of it.

/** Longer than this between two states, in seconds, is a gap. */
export const GAP_S = 5;
/** A vehicle that has hardly moved meanwhile was where it is. */
const GAP_M = 5;
const EARTH_M = 6_371_000;

export interface Timed<P> {
  t: number;
  position: P;
}

interface Geographic {
  latitude_deg: number;
  longitude_deg: number;
}

export function isGap(seconds: number, metres: number, longest_s = GAP_S): boolean {
  return seconds > longest_s && metres > GAP_M;
}

/** Thinned tracks have fewer states: what is usual there is no gap. */
export function longestStep_s(places: readonly { t: number }[]): number {
  const steps = places.slice(1).map(({ t }, index) => t - places[index]!.t);
  steps.sort((one, other) => one - other);
  return Math.max(GAP_S, 4 * (steps[steps.length >> 1] ?? 0));
}

/** Places in order, cut where there are gaps. */
export function pieces<P extends Geographic>(places: readonly Timed<P>[], longest_s: number): P[][] {
  const found: P[][] = [];
  places.forEach(({ t, position }, index) => {
    const before = places[index - 1];
    if (!before || isGap(t - before.t, distance_m(before.position, position), longest_s)) {
      found.push([]);
    }
    found.at(-1)!.push(position);
  });
  return found;
}

/** Over a short distance; the sphere is good enough. */
function distance_m(one: Geographic, other: Geographic): number {
  const rad = Math.PI / 180;
  const north = (other.latitude_deg - one.latitude_deg) * rad;
  const east = (other.longitude_deg - one.longitude_deg) * rad;
  return EARTH_M * Math.hypot(north, east * Math.cos(one.latitude_deg * rad));
}
