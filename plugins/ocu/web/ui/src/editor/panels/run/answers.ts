// What the world does in a rehearsal: the form's rows, written as an answers file (docs/rehearsal.md).
import { readValue, writtenValue, type Value } from "../begin/values";

export type End = "failed" | "stalled" | "lost" | "succeeded" | "simulated";

export const ENDS: readonly End[] = ["failed", "stalled", "lost", "succeeded", "simulated"];

/** Whether it is scripted when a behavior ends in this way; else the simulated vehicle's motion says. */
export const hasTime = (end: End): boolean => end !== "simulated";

/** Whether a behavior that ends in this way does so with an error. */
export const carriesError = (end: End): boolean => end === "failed" || end === "lost";

/** What an operator decides, how many seconds after the question; "": at once. */
export interface ScriptedAnswer {
  decision: string;
  after: string;
}

/**
 * Of a behavior: after how many seconds it ends, how, and with what error. `factor`: by its own motion, it
 * takes so many times as long; "": 1.
 */
export interface ScriptedBehavior {
  element: string;
  after: string;
  factor: string;
  end: End;
  error: string;
}

/** Of a service: what it writes when it is done, or the error that it ends with. */
export interface ScriptedService {
  element: string;
  after: string;
  name: string;
  value: string;
  error: string;
}

export interface ScriptedSend {
  kind: "signal" | "message";
  id: string;
  at: string;
  data: string;
}

export interface Script {
  /** By user task: the answer at the first visit, at the second, ... */
  answers: Readonly<Record<string, readonly ScriptedAnswer[]>>;
  behaviors: readonly ScriptedBehavior[];
  services: readonly ScriptedService[];
  sends: readonly ScriptedSend[];
  /** Sections that have no rows, such as `vehicles` and `wind`, as they are written in the file. */
  more: string;
}

export const EMPTY: Script = { answers: {}, behaviors: [], services: [], sends: [], more: "" };

export const isSeconds = (text: string): boolean => /^\d+(\.\d+)?$/.test(text.trim());

export const isFactor = (text: string): boolean =>
  /^\d*\.?\d+(e[-+]?\d+)?$/i.test(text.trim()) && Number(text) > 0;

/** Whether it is said when or how fast a behavior ends, if that has to be said. */
const isBehaviorTimed = ({ after, factor, end }: ScriptedBehavior): boolean =>
  hasTime(end) ? isSeconds(after) : factor.trim() === "" || isFactor(factor);

/** Whether nothing is missing in the rows: times, and what is meant. */
export function isComplete(script: Script): boolean {
  const timed = (text: string) => text.trim() === "" || isSeconds(text);
  return (
    Object.values(script.answers).every((visits) => visits.every(({ after }) => timed(after))) &&
    script.behaviors.every((row) => row.element && isBehaviorTimed(row)) &&
    script.services.every((row) => row.element && timed(row.after) && isGiven(row)) &&
    script.sends.every(({ id, at, data }) => id && isSeconds(at) && dataOf(data) !== undefined)
  );
}

/** A service writes a value under a name, fails, or just ends. */
export function isGiven({ name, value, error }: ScriptedService): boolean {
  if (error.trim()) return true;
  return (name.trim() === "") === (value.trim() === "") && readValue(value).kind !== "unreadable";
}

/** The text of the answers file; "" where nothing is scripted. */
export function yamlOf(script: Script): string {
  const parts: string[] = [];
  const answers = Object.entries(script.answers).filter(([, visits]) => visits.length > 0);
  if (answers.length) {
    parts.push(
      "answers:",
      ...answers.map(([id, visits]) => `  ${key(id)}: [${visits.map(answerEntry).join(", ")}]`),
    );
  }
  parts.push(...grouped("services", script.services, serviceEntry));
  parts.push(...grouped("behaviors", script.behaviors, behaviorEntry));
  for (const kind of ["signal", "message"] as const) {
    const sends = script.sends.filter((each) => each.kind === kind);
    if (sends.length) parts.push(`${kind}s:`, ...sends.map((each) => `  - ${sendEntry(each)}`));
  }
  if (script.more.trim()) parts.push(script.more.trimEnd());
  return parts.length ? `${parts.join("\n")}\n` : "";
}

function grouped<Row extends { element: string }>(
  title: string,
  rows: readonly Row[],
  entry: (row: Row) => string,
): string[] {
  const elements = [...new Set(rows.map(({ element }) => element))];
  if (elements.length === 0) return [];
  const lines = elements.flatMap((element) => [
    `  ${key(element)}:`,
    ...rows.filter((row) => row.element === element).map((row) => `    - ${entry(row)}`),
  ]);
  return [`${title}:`, ...lines];
}

const key = (id: string): string => writtenValue(id);
const written = (value: string): string => writtenValue(value);
const seconds = (text: string): string => `${Number(text)} s`;

function flow(pairs: readonly (readonly [name: string, text: string])[]): string {
  return `{${pairs.map(([name, text]) => `${name}: ${text}`).join(", ")}}`;
}

function answerEntry({ decision, after }: ScriptedAnswer): string {
  if (!after.trim()) return written(decision);
  return flow([
    ["decision", written(decision)],
    ["after", seconds(after)],
  ]);
}

function behaviorEntry({ after, factor, end, error }: ScriptedBehavior): string {
  return flow([
    ...(hasTime(end) ? [["after", seconds(after)] as const] : []),
    ["end", end],
    ...(!hasTime(end) && factor.trim() ? [["factor", String(Number(factor))] as const] : []),
    ...(carriesError(end) && error.trim() ? [["error", written(error.trim())] as const] : []),
  ]);
}

function serviceEntry({ after, name, value, error }: ScriptedService): string {
  const writes = flow([[key(name.trim()), writtenValue(readValue(value).value)]]);
  return flow([
    ...(after.trim() ? [["after", seconds(after)] as const] : []),
    ...(error.trim() ? [["error", written(error.trim())] as const] : []),
    ...(!error.trim() && name.trim() ? [["write", writes] as const] : []),
  ]);
}

function sendEntry({ id, at, data }: ScriptedSend): string {
  const map = Object.entries(dataOf(data) ?? {}).map(
    ([name, value]) => [key(name), writtenValue(value)] as const,
  );
  return flow([
    ["at", seconds(at)],
    ["id", written(id)],
    ...(map.length ? [["data", flow(map)] as const] : []),
  ]);
}

/** "a = 1, b = x" as a map; undefined: it cannot be read. */
export function dataOf(text: string): Record<string, Value> | undefined {
  if (text.trim() === "") return {};
  const made: Record<string, Value> = {};
  for (const part of text.split(",")) {
    const [, name, value] = /^\s*([\p{L}_][\p{L}\p{N}_.]*)\s*=(.*)$/u.exec(part) ?? [];
    if (name === undefined || value === undefined) return undefined;
    const read = readValue(value);
    if (read.kind === "unreadable") return undefined;
    made[name] = read.value;
  }
  return made;
}
