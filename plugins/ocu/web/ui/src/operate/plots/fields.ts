// What can be plotted of a state: the quantities that people know, and every other number in it.
import { heading_deg, speed_m_s } from "../../shared/format";
import type { PayloadState, VehicleState } from "../../shared/types";

export type State = VehicleState | PayloadState;

/** Steps between words, rather than a line between numbers. */
export const LINK_LEVELS = ["lost", "degraded", "connected"] as const;

/** Values of a state by field: numbers that are known. */
export function numbersOf(state: State): Map<string, number> {
  const found = new Map<string, number>();
  found.set("link", LINK_LEVELS.indexOf(state.link));
  for (const [name, value] of Object.entries(state)) {
    if (name === "time_us" || name === "link" || value === null) continue;
    known(found, name, value as unknown);
  }
  return found;
}

function known(found: Map<string, number>, name: string, value: unknown): void {
  if (name === "velocity_enu_m_s" && isVector(value)) {
    put(found, "speed_m_s", speed_m_s(value));
    put(found, "climb_m_s", value[2]);
  } else if (name === "yaw_rad" && typeof value === "number") {
    put(found, "heading_deg", heading_deg(value));
  } else if (name === "battery_fraction" && typeof value === "number") {
    put(found, "battery_percent", value * 100);
  } else if (["footprint", "detections", "home"].includes(name)) {
    // Corners and objects are on the map; home stays where it is.
  } else if (typeof value === "number") {
    put(found, ...inDegrees(name, value));
  } else if (typeof value === "object" && value !== null && !Array.isArray(value)) {
    for (const [part, inner] of Object.entries(value)) {
      if (typeof inner === "number") put(found, ...inDegrees(`${name}.${part}`, inner));
    }
  }
}

function put(found: Map<string, number>, name: string, value: number): void {
  if (Number.isFinite(value)) found.set(name, value);
}

function inDegrees(name: string, value: number): [string, number] {
  return name.endsWith("_rad") ? [name.replace(/_rad$/, "_deg"), (value * 180) / Math.PI] : [name, value];
}

const isVector = (value: unknown): value is [number, number, number] =>
  Array.isArray(value) && value.length === 3 && value.every((each) => typeof each === "number");

const UNITS: readonly [RegExp, string][] = [
  [/_percent$/, "%"],
  [/_m_s$/, "m/s"],
  [/_deg$/, "°"],
  [/_m$/, "m"],
  [/_s$/, "s"],
  [/_v$/, "V"],
  [/_a$/, "A"],
  [/_fraction$/, ""],
];

/** The unit at the end of a field's name; "": none. */
export function unitOf(field: string): string {
  return UNITS.find(([ending]) => ending.test(field))?.[1] ?? "";
}

/** A field's name as words, without its unit. */
export function wordsOf(field: string): string {
  const bare = UNITS.reduce((name, [ending]) => name.replace(ending, ""), field);
  const words = bare.replaceAll(".", " ").replaceAll("_", " ");
  return words.charAt(0).toUpperCase() + words.slice(1);
}

/** Quantities that go round: a line from 359 to 0 would cross the chart. */
const ROUND = new Set(["heading_deg"]);
const HALF_TURN_DEG = 180;

export const goesRound = (field: string, before: number, now: number): boolean =>
  ROUND.has(field) && Math.abs(now - before) > HALF_TURN_DEG;
