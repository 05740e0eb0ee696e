// Which records the event log shows.
import { lineOf, type LogKind, type LogLine } from "../../records/logLine";
import type { RunRecord } from "../../shared/types";

export interface Wanted {
  words: string;
  hidden: ReadonlySet<LogKind>;
  urgentOnly: boolean;
}

/** Lines are made once for each record; records do not change. */
export class Lines {
  private readonly made = new WeakMap<RunRecord, LogLine>();

  of(record: RunRecord): LogLine {
    let line = this.made.get(record);
    if (!line) this.made.set(record, (line = lineOf(record)));
    return line;
  }

  /** Of the newest `most` records those that are wanted, oldest first. */
  wanted(records: readonly RunRecord[], wanted: Wanted, most: number): LogLine[] {
    const words = wanted.words.trim().toLowerCase();
    const found: LogLine[] = [];
    for (let index = Math.max(0, records.length - most); index < records.length; index += 1) {
      const line = this.of(records[index]!);
      if (wanted.hidden.has(line.kind) && !line.urgent) continue;
      if (wanted.urgentOnly && !line.urgent) continue;
      if (
        words &&
        !line.text.toLowerCase().includes(words) &&
        !line.record.toLowerCase().includes(words)
      ) {
        continue;
      }
      found.push(line);
    }
    return found;
  }
}
