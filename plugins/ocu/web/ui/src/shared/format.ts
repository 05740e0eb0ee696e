// Numbers as people read them.
import { locale } from "../strings/language";

/** 4 s is "0:04", two hours and a bit "2:00:09". */
export function clock(seconds: number): string {
  const whole = Math.max(0, Math.floor(seconds));
  const two = (part: number) => String(part).padStart(2, "0");
  const hours = Math.floor(whole / 3600);
  const minutes = Math.floor(whole / 60) % 60;
  return hours > 0
    ? `${hours}:${two(minutes)}:${two(whole % 60)}`
    : `${minutes}:${two(whole % 60)}`;
}

/** With tenths, for what happens within a second. */
export const clockTenths = (seconds: number): string =>
  `${clock(seconds)}.${Math.floor((Math.max(0, seconds) * 10) % 10)}`;

/** Older states are stale: as a fleet's `lost_after`, where it says nothing. */
export const STALE_S = 3;

export function age(seconds: number): string {
  if (seconds < 120) return `${Math.round(seconds)} s`;
  return seconds < 7200 ? `${Math.round(seconds / 60)} min` : `${Math.round(seconds / 3600)} h`;
}

/** Degrees from north, clockwise, of a yaw from east, counter-clockwise. */
export const heading_deg = (yaw_rad: number): number =>
  (((90 - (yaw_rad * 180) / Math.PI) % 360) + 360) % 360;

export const speed_m_s = ([east, north, up]: [number, number, number]): number =>
  Math.hypot(east, north, up);

export const dateTime = (time_us: number): string =>
  new Date(time_us / 1000).toLocaleString(locale);

/** A whole number, in groups: "1,234". */
export const grouped = (value: number): string => value.toLocaleString(locale);

const FIXED = [0, 1, 2, 3].map((decimals) => {
  const digits = { minimumFractionDigits: decimals, maximumFractionDigits: decimals };
  return new Intl.NumberFormat(locale, { ...digits, useGrouping: false });
});

/** So many decimals, 0 to 3: "1.5", in German "1,5". For what is read, not for what is entered. */
export const fixed = (value: number, decimals: number): string => FIXED[decimals]!.format(value);
