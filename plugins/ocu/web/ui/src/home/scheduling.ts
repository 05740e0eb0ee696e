// What the dialog asks for when a mission is to start later, as the server takes it.
import { readValue, type Value } from "../editor/panels/begin/values";
import { ApiError } from "../shared/api";
import { fill } from "../strings";

export type Kind = "free" | "at" | "cron";
export type Outcome = "completed" | "terminated" | "failed" | "stopped";

/** As it is written in the fields; durations are numbers. */
export interface Form {
  mission: string;
  process: string;
  /** Lines "name = value". */
  data: string;
  kind: Kind;
  at: string;
  cron: string;
  until: string;
  after: string;
  outcomes: readonly Outcome[];
  condition: string;
  vehicles: readonly string[];
  heldForS: string;
  deadlineMin: string;
  missed: "skip" | "run-once";
  concurrency: "forbid" | "allow";
  priority: string;
}

export type Field = Exclude<keyof Form, "kind">;
export type Errors = Partial<Record<Field, string>>;

export const EMPTY: Form = {
  mission: "",
  process: "",
  data: "",
  kind: "at",
  at: "",
  cron: "",
  until: "",
  after: "",
  outcomes: ["completed"],
  condition: "",
  vehicles: [],
  heldForS: "",
  deadlineMin: "",
  missed: "skip",
  concurrency: "forbid",
  priority: "0",
};

/** The fields whose errors the server names otherwise. */
const FIELDS: Record<string, Field> = {
  held_for_s: "heldForS",
  starting_deadline_s: "deadlineMin",
  time_zone: "at",
};
const SECONDS_IN_MINUTE = 60;

export interface Messages {
  needed: string;
  notNumber: string;
  notInteger: string;
  notData: string;
}

/** What the form lacks or has wrong, as far as this page can tell. */
export function errorsOf(form: Form, words: Messages): Errors {
  const errors: Errors = {};
  if (!form.mission) errors.mission = words.needed;
  if (form.kind === "at" && !form.at) errors.at = words.needed;
  if (form.kind === "cron" && !form.cron.trim()) errors.cron = words.needed;
  if (form.after && form.outcomes.length === 0) errors.outcomes = words.needed;
  if (form.condition.trim() && !isDuration(form.heldForS)) errors.heldForS = words.notNumber;
  if (!isDuration(form.deadlineMin)) errors.deadlineMin = words.notNumber;
  if (!/^[-+]?\d+$/.test(form.priority.trim())) errors.priority = words.notInteger;
  const { wrong } = readData(form.data);
  if (wrong) errors.data = fill(words.notData, { line: wrong });
  return errors;
}

const isDuration = (text: string): boolean => {
  const seconds = Number(text);
  return Number.isFinite(seconds) && seconds >= 0;
};

/** The values by their names; null: a line is not of the form. */
export function dataOf(text: string): Record<string, Value> | null {
  const { values, wrong } = readData(text);
  return wrong ? null : values;
}

/** The values by their names, and the first line that is not of the form; "": all are. */
function readData(text: string): { values: Record<string, Value>; wrong: string } {
  const values: Record<string, Value> = {};
  for (const line of text.split("\n").filter((each) => each.trim())) {
    const [, name, written] = /^\s*([^=\s]+)\s*=(.*)$/.exec(line) ?? [];
    const read = written === undefined ? undefined : readValue(written);
    if (name === undefined || name in values || !read || read.kind === "unreadable") {
      return { values, wrong: line.trim() };
    }
    values[name] = read.value;
  }
  return { values, wrong: "" };
}

/** What is sent. Only what was filled in is in it. */
export function requestOf(form: Form, zone: string): object {
  const when: Record<string, unknown> = {};
  if (form.kind === "at") when["at"] = form.at;
  if (form.kind === "cron") when["cron"] = form.cron.trim();
  if (form.until) when["until"] = form.until;
  if (form.kind !== "free" || form.until) when["time_zone"] = zone;
  if (form.after && form.kind !== "cron") {
    when["after"] = form.after;
    when["outcomes"] = form.outcomes;
  }
  if (form.condition.trim()) {
    when["condition"] = form.condition.trim();
    when["vehicles"] = form.vehicles;
    when["held_for_s"] = Number(form.heldForS);
  }
  if (form.deadlineMin.trim()) {
    when["starting_deadline_s"] = Number(form.deadlineMin) * SECONDS_IN_MINUTE;
  }
  when["missed"] = form.missed;
  when["concurrency"] = form.concurrency;
  return {
    mission: form.mission,
    process: form.process || null,
    data: dataOf(form.data) ?? {},
    when,
    priority: Number(form.priority),
  };
}

interface Wrong {
  where: string;
  what: string;
}

/** The fields that the server refuses; what belongs to none of them is in `rest`. */
export function refusalOf(error: ApiError): { errors: Errors; rest: string } {
  const { field, wrong } = error.problem as { field?: string; wrong?: Wrong[] };
  const errors: Errors = {};
  const places: Wrong[] = field ? [{ where: field, what: error.message }] : (wrong ?? []);
  const others: string[] = [];
  for (const { where, what } of places) {
    const name = where.split(".").find((part) => part in EMPTY || part in FIELDS);
    const known = name === undefined ? undefined : (FIELDS[name] ?? (name as Field));
    if (known === undefined) others.push(`${where}: ${what}`);
    else errors[known] = what;
  }
  return { errors, rest: places.length > 0 ? others.join("; ") : error.message };
}
