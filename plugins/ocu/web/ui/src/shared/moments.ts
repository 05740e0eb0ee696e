// Dates and times as people of this place write them.
const MOMENT = new Intl.DateTimeFormat(undefined, { dateStyle: "medium", timeStyle: "short" });

/** `ms`: since the Unix epoch. */
export function moment(ms: number): string {
  return MOMENT.format(ms);
}
