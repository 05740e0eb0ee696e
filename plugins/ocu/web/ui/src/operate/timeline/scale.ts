// Between mission time and pixels of the time line.
import type { Range } from "../plots/series";

/** What is seen: from `from_s`, `px_per_s` pixels a second. */
export interface Window {
  from_s: number;
  px_per_s: number;
}

/** The same, from its first to its last second, however wide it is drawn. */
export const rangeOf = ({ from_s, px_per_s }: Window, width_px: number): Range => ({
  from_s,
  to_s: from_s + width_px / px_per_s,
});

export const windowOf = ({ from_s, to_s }: Range, width_px: number): Window => ({
  from_s,
  px_per_s: width_px / (to_s - from_s),
});

/** A month in 130 pixels. */
const LEAST_PX_PER_S = 0.00005;
const MOST_PX_PER_S = 400;

export function whole(end_s: number, width_px: number): Window {
  return { from_s: 0, px_per_s: Math.max(LEAST_PX_PER_S, (width_px - 16) / Math.max(end_s, 5)) };
}

export function zoomed(window: Window, factor: number, around_px: number): Window {
  const px_per_s = Math.max(LEAST_PX_PER_S, Math.min(MOST_PX_PER_S, window.px_per_s * factor));
  const around_s = window.from_s + around_px / window.px_per_s;
  return { px_per_s, from_s: Math.max(0, around_s - around_px / px_per_s) };
}

const DAY_S = 86_400;
const DAYS_S = [1, 3, 7, 30].map((days) => days * DAY_S);
const STEPS_S = [0.1, 0.5, 1, 2, 5, 10, 30, 60, 120, 300, 600, 1800, 3600, 7200, 21600, ...DAYS_S];

/** Times that are marked, not closer than `least_px`. */
export function marks(window: Window, width_px: number, least_px: number): number[] {
  const step = STEPS_S.find((each) => each * window.px_per_s >= least_px) ?? DAYS_S.at(-1)!;
  const last_s = window.from_s + width_px / window.px_per_s;
  const found: number[] = [];
  for (let index = Math.ceil(window.from_s / step); index * step <= last_s; index += 1) {
    found.push(index * step);
  }
  return found;
}

export interface Bar<T> {
  span: T;
  lane: number;
}

/** Bars of a row that overlap get lanes of their own. */
export function lanes<T extends { from: number; to: number | null }>(
  spans: readonly T[],
): Bar<T>[] {
  const ends: number[] = [];
  return [...spans]
    .sort((one, other) => one.from - other.from)
    .map((span) => {
      const free = ends.findIndex((end) => end <= span.from);
      const lane = free < 0 ? ends.length : free;
      ends[lane] = span.to ?? Infinity;
      return { span, lane };
    });
}
