// How a vehicle is, in one word: on maps and in the table of the fleet.
import type { VehicleState } from "../shared/types";

export type Health = "ok" | "degraded" | "lowBattery" | "notReady" | "unheard" | "unknown" | "lost";

export const LOW_BATTERY = 0.25;

/** The worst last. */
const HEALTHS: readonly Health[] = [
  "ok",
  "degraded",
  "lowBattery",
  "notReady",
  "unheard",
  "unknown",
  "lost",
];

export const rankOf = (health: Health): number => HEALTHS.indexOf(health);

export interface Condition {
  /** Whether it has ever reported. */
  isKnown: boolean;
  /** The executive is not connected: what was received before may be over. */
  isUnknown?: boolean;
  /** By its link, or as it has been silent for too long. */
  isLost: boolean;
  ready: boolean | null;
  isLow: boolean;
  link: VehicleState["link"] | "unknown";
}

export function healthOf({ isUnknown, isKnown, isLost, ready, isLow, link }: Condition): Health {
  if (isUnknown) return "unknown";
  if (isLost) return "lost";
  if (!isKnown) return "unheard";
  if (ready === false) return "notReady";
  if (isLow) return "lowBattery";
  return link === "degraded" ? "degraded" : "ok";
}

export const isLow = (battery: number | null): boolean => battery !== null && battery < LOW_BATTERY;
