// What the server says of an alert (docs/operating.md, Alerts).
export type Severity = "critical" | "error" | "warning" | "notice";

export const SEVERITIES: readonly Severity[] = ["critical", "error", "warning", "notice"];

/** Times in microseconds since the Unix epoch, by the executive's clock; "": nobody. */
export interface OperatorAlert {
  alert: string;
  severity: Severity;
  code: string;
  text: string;
  raised_us: number;
  last_us: number;
  run: string;
  resources: string[];
  /** The id of a prompt or incident. */
  subject: string;
  count: number;
  details: string[];
  deadline_us: number | null;
  cleared_us: number | null;
  acknowledged_by: string;
  acknowledged_us: number | null;
  owner: string;
  owned_us: number | null;
  age_s: number;
  left_s: number | null;
  /** It is open, and nobody has acknowledged it. */
  calls: boolean;
}

/** Whether a severity is at least another one. */
export const isAtLeast = (severity: Severity, least: Severity): boolean =>
  SEVERITIES.indexOf(severity) <= SEVERITIES.indexOf(least);
