// A record as a line of the event log: what it says, of which kind it is, and whether it is urgent.
import { strings } from "../strings";
import type { RunRecord } from "../shared/types";

export type LogKind = "run" | "tokens" | "behaviors" | "prompts" | "events" | "data" | "operators";

export const LOG_KINDS: LogKind[] = [
  "run",
  "behaviors",
  "prompts",
  "operators",
  "events",
  "data",
  "tokens",
];

export interface LogLine {
  seq: number;
  t: number;
  record: string;
  kind: LogKind;
  text: string;
  urgent: boolean;
  process: string;
  element: string;
}

/**
 * What the mission calls an element, and what it defines for the whole file: a signal, a message.
 */
export interface Names {
  element(process: string, element: string): string;
  definition(id: string): string;
}

const KINDS: [RegExp, LogKind][] = [
  [/^Run|^Input/, "run"],
  [/^Behavior|^Service/, "behaviors"],
  [/^Prompt/, "prompts"],
  [/^Operator|^GeometryReceived/, "operators"],
  [/^DataWritten|^InstanceOutput/, "data"],
  [/Thrown$|^Event|^Condition|^Compensation|^Transaction/, "events"],
];

const BAD_STATES = new Set(["FAILED", "REJECTED", "LOST", "UNKNOWN"]);

export function kindOf(record: string): LogKind {
  return KINDS.find(([pattern]) => pattern.test(record))?.[1] ?? "tokens";
}

export function isUrgent(record: RunRecord): boolean {
  switch (record.record) {
    case "PromptOpened":
    case "ErrorThrown":
    case "BehaviorUnsettled":
    case "OperatorTookControl":
    case "RunPaused":
      return true;
    case "BehaviorEnded":
      return BAD_STATES.has(String(record.state));
    case "ServiceEnded":
      return Boolean(record.code);
    case "TokenLeft":
      return record.outcome === "failed";
    case "RunEnded":
      return record.outcome === "failed" || record.outcome === "stopped";
    default:
      return false;
  }
}

export function lineOf(record: RunRecord, names: Names): LogLine {
  const process = record.process ?? "";
  const element = record.element ?? "";
  const where = element ? names.element(process, element) : "";
  return {
    seq: record.seq,
    t: record.t,
    record: record.record,
    kind: kindOf(record.record),
    text: textOf(record, where, names),
    urgent: isUrgent(record),
    process,
    element,
  };
}

const templates: Readonly<Record<string, string>> = strings.operate.records;

const DEFINED = new Set(["signal", "message", "escalation", "ref"]);

/**
 * In a template `{field}` is a field of the record, and `[...]` is left out if one in it is empty.
 */
function textOf(record: RunRecord, where: string, names: Names): string {
  const template = templates[record.record];
  if (template === undefined) return [record.record, where].filter(Boolean).join(" · ");
  const value = (field: string) => (field === "where" ? where : valueOf(record, field, names));
  const filled = (part: string) => part.replace(/\{(\w+)\}/g, (_, field: string) => value(field));
  const isWhole = (part: string) =>
    [...part.matchAll(/\{(\w+)\}/g)].every(([, field]) => value(field!) !== "");
  const chosen = template.replace(/\[([^\]]*)\]/g, (_, part: string) =>
    isWhole(part) ? part : "",
  );
  return filled(chosen).trim();
}

function valueOf(record: RunRecord, field: string, names: Names): string {
  const value = record[field];
  if (value === undefined || value === null) return "";
  if (Array.isArray(value)) return value.map(String).join(", ");
  if (typeof value === "object") return JSON.stringify(value);
  if (DEFINED.has(field)) return names.definition(String(value));
  return field === "state" || field === "outcome" ? String(value).toLowerCase() : String(value);
}
