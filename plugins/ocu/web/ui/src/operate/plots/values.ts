// Values as people read them.
import { strings } from "../../strings";
import { LINK_LEVELS, unitOf } from "./fields";
import type { TelemetryHistory } from "./history";
import { fixed } from "../../shared/format";

export function readValue(
  history: TelemetryHistory,
  resource: string,
  field: string,
  t: number,
): string {
  const value = history.series(resource, field)?.at(t) ?? null;
  if (value === null) return "–";
  if (field === "link") return strings.plots.links[LINK_LEVELS[Math.round(value)]!];
  return `${written(value)} ${unitOf(field)}`.trim();
}

function written(value: number): string {
  const size = Math.abs(value);
  return fixed(value, size >= 100 ? 0 : size >= 1 ? 1 : 2);
}
