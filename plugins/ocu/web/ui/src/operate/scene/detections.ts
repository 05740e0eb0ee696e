// What payloads detected in a run, by number.
import type { Detection } from "../../shared/types";

export interface Detections {
  all: readonly Detection[];
  /** How many there are besides, of which nothing but their number was kept. */
  more: number;
}

export const NO_DETECTIONS: Detections = { all: [], more: 0 };

interface Sample {
  detections?: readonly Detection[];
  more_detections?: number;
}

/** The detections of a track. */
export function detectionsOf(samples: readonly Sample[]): Detections {
  const found = samples.flatMap(({ detections = [] }) => detections);
  const more = samples.reduce((sum, { more_detections = 0 }) => sum + more_detections, 0);
  return withDetections(NO_DETECTIONS, { all: found, more });
}

/** A later one of the same number replaces the one before. */
export function withDetections(before: Detections, now: Detections): Detections {
  const byNumber = new Map(before.all.map((each) => [each.number, each]));
  for (const each of now.all) byNumber.set(each.number, each);
  const all = [...byNumber.values()].sort((one, other) => one.number - other.number);
  return { all, more: Math.max(before.more, now.more) };
}
