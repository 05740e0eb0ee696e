// A record as a line of the event log. Its sentence comes from the server, which words records for
// all units.
import type { LogKind, RunRecord } from "../shared/types";

export type { LogKind };

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

export function lineOf(record: RunRecord): LogLine {
  return {
    seq: record.seq,
    t: record.t,
    record: record.record,
    kind: record.kind,
    text: record.sentence,
    urgent: record.urgent,
    process: record.process ?? "",
    element: record.element ?? "",
  };
}
