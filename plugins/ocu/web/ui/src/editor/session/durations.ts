// Durations as people write them ("5 min", "1 h 30 min") and as the file has them (ISO 8601).
import { isExpression } from "./quantities";

/** By unit: the words for it, and how ISO 8601 writes so many of it. */
const UNITS: readonly { iso: string; inTime: boolean; shown: string; words: RegExp }[] = [
  { iso: "W", inTime: false, shown: "weeks", words: /^(w|weeks?)$/ },
  { iso: "D", inTime: false, shown: "d", words: /^(d|days?)$/ },
  { iso: "H", inTime: true, shown: "h", words: /^(h|hrs?|hours?)$/ },
  { iso: "M", inTime: true, shown: "min", words: /^(m|mins?|minutes?)$/ },
  { iso: "S", inTime: true, shown: "s", words: /^(s|secs?|seconds?)$/ },
];

const NUMBERS: Record<string, string> = {
  a: "1",
  an: "1",
  one: "1",
  two: "2",
  three: "3",
  four: "4",
  five: "5",
  ten: "10",
  twenty: "20",
  thirty: "30",
};

const ISO =
  /^P(?!$)(\d+Y)?(\d+M)?(\d+(?:[.,]\d+)?W)?(\d+(?:[.,]\d+)?D)?(?:T(?!$)(\d+(?:[.,]\d+)?H)?(\d+(?:[.,]\d+)?M)?(\d+(?:[.,]\d+)?S)?)?$/;

const PART = /^(\d+(?:\.\d+)?|[a-z]+)\s*([a-z]+)$/;
/** Between parts: a space, a comma, "and". */
const PARTS = /(?:\d+(?:\.\d+)?\s*[a-z]+|\b(?:an?|one|two|three|four|five|ten|twenty|thirty)\s+[a-z]+)/g;

export const isIsoDuration = (text: string): boolean => ISO.test(text);

/** "1 h 30 min" in ISO 8601: PT1H30M. What is ISO 8601 stays; undefined: it is no duration. */
export function isoOf(text: string): string | undefined {
  const said = text.trim().toLowerCase();
  if (isIsoDuration(text.trim())) return text.trim();
  const parts = said.match(PARTS) ?? [];
  if (parts.length === 0 || said.replace(PARTS, "").replace(/\band\b|[\s,]/g, "") !== "") {
    return undefined;
  }
  const written = new Map<string, string>();
  let last = -1;
  for (const part of parts) {
    const [, number = "", word = ""] = PART.exec(part) ?? [];
    const at = UNITS.findIndex(({ words }) => words.test(word));
    const count = NUMBERS[number] ?? number;
    // From the greatest unit to the least, each once.
    if (at <= last || !/^\d/.test(count)) return undefined;
    last = at;
    written.set(UNITS[at]!.iso, count);
  }
  const join = (inTime: boolean) =>
    UNITS.filter((unit) => unit.inTime === inTime && written.has(unit.iso))
      .map(({ iso }) => `${written.get(iso)}${iso}`)
      .join("");
  const time = join(true);
  return `P${join(false)}${time && `T${time}`}`;
}

const RUN = new RegExp(`(?:${PARTS.source})(?:(?:\\s*,\\s*|\\s+and\\s+|\\s*)(?:${PARTS.source}))*`);

/** The first duration in a text, and where it stands in it. */
export function durationIn(text: string): { text: string; iso: string } | undefined {
  const [said] = RUN.exec(text) ?? [];
  const iso = said === undefined ? undefined : isoOf(said);
  return said !== undefined && iso ? { text: said, iso } : undefined;
}

/** PT1H30M as people write it: "1 h 30 min"; what is none is shown as it stands. */
export function shownDuration(iso: string): string {
  const [, years, months, weeks, days, hours, minutes, seconds] = ISO.exec(iso.trim()) ?? [];
  // How long a month or a year is depends on when it begins: it has no short form here.
  if (years || months) return iso;
  const parts = [weeks, days, hours, minutes, seconds];
  const said = parts.flatMap((part, at) => (part ? [shownPart(part, UNITS[at]!.shown)] : []));
  return said.length ? said.join(" ") : iso;
}

function shownPart(part: string, unit: string): string {
  const number = part.slice(0, -1).replace(",", ".");
  return `${number} ${number === "1" && unit === "weeks" ? "week" : unit}`;
}

const CYCLE = /^R(\d*)\/(P[^/]+)$/;
const EVERY = /^every\s+(.+?)(?:[,\s]+(\d+)\s+times)?$/i;
const TIMES = /^(\d+)\s+times[,\s]+every\s+(.+)$/i;
const EVERY_ONE = /^(s|sec|second|m|min|minute|h|hour|d|day|w|week)$/i;

/** "3 times every 10 s" in ISO 8601: R3/PT10S. Other texts stay as they are: dates, cron texts. */
export function isoCycleOf(text: string): string {
  const said = text.trim();
  const [, counted, often] = TIMES.exec(said) ?? [];
  const [, each, count] = EVERY.exec(said) ?? [];
  const every = often ?? each;
  if (every === undefined) return said;
  const period = isoOf(EVERY_ONE.test(every) ? `1 ${every}` : every);
  return period ? `R${counted ?? count ?? ""}/${period}` : said;
}

export function shownCycle(iso: string): string {
  const [, count, period] = CYCLE.exec(iso.trim()) ?? [];
  if (period === undefined || !isIsoDuration(period)) return iso;
  const every = `every ${shownDuration(period)}`;
  return count ? `${count} times ${every}` : every;
}

/** What a field of a duration writes: ISO 8601 where it can be read, else what was typed. */
export function writtenDuration(text: string): string {
  const said = text.trim();
  return isExpression(said) ? said : (isoOf(said) ?? said);
}

const SECONDS: Record<string, number> = { W: 604800, D: 86400, H: 3600, M: 60, S: 1 };

/** "1 h 30 min" as one quantity, which parameters of behaviors take: "90 min". */
export function quantityOf(text: string): string {
  const iso = /^P/i.test(text.trim()) ? undefined : isoOf(text);
  if (iso === undefined) return text.trim();
  const parts = [...iso.matchAll(/([\d.]+)([WDHMS])/g)];
  const seconds = parts.reduce((sum, [, n, unit]) => sum + Number(n) * SECONDS[unit!]!, 0);
  const least = parts.at(-1)?.[2] ?? "S";
  const unit = { S: "s", M: "min" }[least] ?? "h";
  const size = { s: 1, min: 60, h: 3600 }[unit]!;
  return `${Number((seconds / size).toPrecision(9))} ${unit}`;
}
