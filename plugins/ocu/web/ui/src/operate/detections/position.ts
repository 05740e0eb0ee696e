// Where something was detected, in words.
import type { Detection } from "../../shared/types";
import { fill, strings } from "../../strings";

const text = strings.operate.detections;

const digits = (value: number, count: number): string => value.toFixed(count);

export function positionOf({ position }: Detection): string {
  const { latitude_deg, longitude_deg, altitude_m } = position;
  if (latitude_deg === null || longitude_deg === null) return text.noPosition;
  const at = { latitude: digits(latitude_deg, 6), longitude: digits(longitude_deg, 6) };
  return altitude_m === null
    ? fill(text.position, at)
    : fill(text.positionAltitude, { ...at, altitude: digits(altitude_m, 0) });
}
