// What is plotted, as a table: a row for each time at which something of a resource was recorded.
import type { TelemetryHistory } from "./history";
import type { Range } from "./series";

/** RFC 4180; times in seconds of mission time. Empty: not known then, or not recorded then. */
export function csvOf(
  history: TelemetryHistory,
  resources: readonly string[],
  fields: readonly string[],
  { from_s, to_s }: Range,
): string {
  const lines = [["time_s", "resource", ...fields].map(quoted).join(",")];
  const rows: { t: number; line: string }[] = [];
  for (const resource of resources) {
    const series = fields.map((field) => history.series(resource, field));
    const at = new Map<number, string[]>();
    series.forEach((each, column) => {
      if (!each) return;
      const end = each.countAt(to_s);
      for (let index = 0; index < end; index += 1) {
        const t = each.timeAt(index);
        if (t < from_s) continue;
        let row = at.get(t);
        if (!row) at.set(t, (row = fields.map(() => "")));
        const value = each.valueAt(index);
        row[column] = Number.isNaN(value) ? "" : String(Number(value.toPrecision(10)));
      }
    });
    for (const [t, row] of at) {
      rows.push({ t, line: [t.toFixed(3), quoted(resource), ...row].join(",") });
    }
  }
  rows.sort((one, other) => one.t - other.t);
  return [...lines, ...rows.map(({ line }) => line), ""].join("\r\n");
}

const quoted = (text: string): string =>
  /[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
