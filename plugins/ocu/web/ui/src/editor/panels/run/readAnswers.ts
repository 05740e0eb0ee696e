// An answers file, read back into the rows of the form. Nothing is left out: what has no row, is said.
import { parseDocument, stringify } from "yaml";
import { fill, strings } from "../../../strings";
import { writtenValue, type Value } from "../begin/values";
import {
  carriesError,
  dataOf,
  ENDS,
  hasTime,
  isFactor,
  type Script,
  type ScriptedAnswer,
  type ScriptedSend,
} from "./answers";
import keys from "./answersFile.json";

const words = strings.run.answers.unread;

/** What of a mission has rows: the ids of its tasks. */
export interface Rows {
  asking: ReadonlySet<string>;
  serving: ReadonlySet<string>;
  commanding: ReadonlySet<string>;
}

/** The text is no YAML, or says what the form cannot show. */
export class Unread extends Error {}

type Entry = Readonly<Record<string, Value>>;

const SECONDS = { s: 1, ms: 0.001, min: 60, h: 3600 };
const WITH_ROWS = ["answers", "services", "behaviors", "signals", "messages"];
// As yaml_source.py: a few lines of nested aliases must not fill the memory.
const MOST_ALIASES = 100;

/**
 * The rows of the text of an answers file.
 *
 * @throws {Unread}
 */
export function scriptOf(text: string, rows: Rows): Script {
  const file = mapOf(parsed(text) ?? {}, "");
  only(file, keys.sections, "");
  return {
    answers: Object.fromEntries(
      lists(file, "answers", rows.asking).map(([id, visits]) => [
        id,
        visits.map(([place, visit]) => answerOf(visit, place)),
      ]),
    ),
    services: lists(file, "services", rows.serving).flatMap(([element, visits]) =>
      visits.map(([place, visit]) => ({ element, ...serviceOf(mapOf(visit, place), place) })),
    ),
    behaviors: lists(file, "behaviors", rows.commanding).flatMap(([element, visits]) =>
      visits.map(([place, visit]) => ({ element, ...behaviorOf(mapOf(visit, place), place) })),
    ),
    sends: [...sendsOf(file, "signal"), ...sendsOf(file, "message")],
    more: moreOf(file),
  };
}

function parsed(text: string): Value {
  const document = parseDocument(text, { version: "1.2" });
  try {
    if (document.errors[0]) throw document.errors[0];
    return document.toJS({ maxAliasCount: MOST_ALIASES }) as Value;
  } catch (error) {
    // Below the first line, the library draws where it is.
    const [first = ""] = (error as Error).message.split("\n");
    throw new Unread(first.replace(/:$/, ""));
  }
}

/** By element of a section, its visits with where they stand. */
function lists(file: Entry, section: string, known: ReadonlySet<string>) {
  return Object.entries(mapOf(file[section] ?? {}, section)).map(([id, visits]) => {
    const place = `${section}.${id}`;
    if (!known.has(id)) throw unread(words.noTask, place);
    return [id, placed(visits, place)] as const;
  });
}

function placed(values: Value, place: string): (readonly [place: string, value: Value])[] {
  if (!Array.isArray(values)) throw unread(words.noList, place);
  return values.map((value, index) => [`${place}[${index}]`, value] as const);
}

/** The sections that have no rows. */
function moreOf(file: Entry): string {
  const more = Object.entries(file).filter(([section]) => !WITH_ROWS.includes(section));
  return more.length ? stringify(Object.fromEntries(more), { lineWidth: 0 }).trimEnd() : "";
}

function answerOf(visit: Value, place: string): ScriptedAnswer {
  if (typeof visit === "string" || visit === null || typeof visit !== "object") {
    return { decision: textOf(visit, place), after: "" };
  }
  const entry = mapOf(visit, place);
  only(entry, keys.answers, place);
  return {
    decision: textOf(entry["decision"] ?? null, `${place}.decision`),
    after: entry["after"] === undefined ? "" : secondsOf(entry["after"], `${place}.after`),
  };
}

function serviceOf(entry: Entry, place: string) {
  only(entry, keys.services, place);
  const written = Object.entries(mapOf(entry["write"] ?? {}, `${place}.write`));
  if (written.length > 1) throw unread(words.severalWritten, `${place}.write`);
  const [name, value] = written[0] ?? ["", undefined];
  const error = optionalText(entry, "error", place);
  if (error && name) throw unread(words.oneEnd, place);
  return {
    after: entry["after"] === undefined ? "" : secondsOf(entry["after"], `${place}.after`),
    name,
    value: value === undefined ? "" : writtenValue(value),
    error,
  };
}

function behaviorOf(entry: Entry, place: string) {
  only(entry, keys.behaviors, place);
  const end = ENDS.find((each) => each === entry["end"]);
  if (!end) throw unread(fill(words.oneOf, { values: ENDS.join(", ") }), `${place}.end`);
  const error = optionalText(entry, "error", place);
  if (error && !carriesError(end)) throw unread(words.errorOfFailure, `${place}.error`);
  if (!hasTime(end)) {
    if (entry["after"] !== undefined) throw unread(words.noTime, `${place}.after`);
    return { after: "", factor: factorOf(entry["factor"] ?? 1, `${place}.factor`), end, error };
  }
  if (entry["factor"] !== undefined) throw unread(words.noFactor, `${place}.factor`);
  const after = secondsOf(entry["after"] ?? null, `${place}.after`);
  return { after, factor: "", end, error };
}

function sendsOf(file: Entry, kind: ScriptedSend["kind"]): ScriptedSend[] {
  return placed(file[`${kind}s`] ?? [], `${kind}s`).map(([place, value]) => {
    const entry = mapOf(value, place);
    only(entry, keys.sends, place);
    const data = mapOf(entry["data"] ?? {}, `${place}.data`);
    const shown = Object.entries(data)
      .map(([name, each]) => `${name} = ${writtenValue(each)}`)
      .join(", ");
    if (JSON.stringify(dataOf(shown)) !== JSON.stringify(data)) {
      throw unread(words.data, `${place}.data`);
    }
    return {
      kind,
      id: textOf(entry["id"] ?? null, `${place}.id`),
      at: secondsOf(entry["at"] ?? null, `${place}.at`),
      data: shown,
    };
  });
}

/** How many times as long; "" where it is as long. */
function factorOf(value: Value, place: string): string {
  if (typeof value !== "number" || !isFactor(String(value))) throw unread(words.factor, place);
  return value === 1 ? "" : String(value);
}

/** A duration as a number of seconds. */
function secondsOf(value: Value, place: string): string {
  const [, number, unit = "s"] =
    /^\s*(\d+(?:\.\d+)?(?:[eE][-+]?\d+)?)\s*(s|ms|min|h)?\s*$/.exec(String(value)) ?? [];
  if (number === undefined) throw unread(words.duration, place);
  const factor = SECONDS[unit as keyof typeof SECONDS];
  // What was drawn in a campaign is kept to the last digit: the rehearsal shall be the same.
  const seconds = factor === 1 ? Number(number) : Number((Number(number) * factor).toPrecision(12));
  const text = String(seconds);
  return text.includes("e") ? seconds.toFixed(9) : text;
}

function mapOf(value: Value, place: string): Entry {
  if (value === null || typeof value !== "object" || Array.isArray(value)) {
    throw unread(words.noMap, place);
  }
  return value;
}

function textOf(value: Value, place: string, mayLack = false): string {
  if (typeof value !== "string" || (value === "" && !mayLack)) throw unread(words.noText, place);
  return value;
}

function optionalText(entry: Entry, name: string, place: string): string {
  return textOf(entry[name] ?? "", `${place}.${name}`, true);
}

function only(entry: Entry, names: readonly string[], place: string): void {
  const other = Object.keys(entry).find((name) => !names.includes(name));
  if (other === undefined) return;
  const where = place ? `${place}.${other}` : other;
  throw unread(fill(words.oneOf, { values: names.join(", ") }), where);
}

const unread = (reason: string, place: string): Unread =>
  new Unread(place ? `${place}: ${reason}` : reason);
