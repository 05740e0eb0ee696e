// Dates and times as people of this place write them.
import { locale } from "../strings/language";

const MOMENT = new Intl.DateTimeFormat(locale, { dateStyle: "medium", timeStyle: "short" });

const TIME = new Intl.DateTimeFormat(undefined, { timeStyle: "medium", hourCycle: "h23" });

/** `ms`: since the Unix epoch. */
export function moment(ms: number): string {
  return MOMENT.format(ms);
}

/** With seconds, without the date. */
export function timeOfDay(ms: number): string {
  return TIME.format(ms);
}
