// The records of a run that goes on: read by page from the start, then as they are pushed. When
// more come than can be followed, some are left out and counted.
import { signal, type ReadonlySignal } from "@preact/signals";
import { Spans } from "../../records/spans";
import type { Command, RunRecord } from "../../shared/types";
import type { LogPage } from "./scene";

/** `next`: where to go on; null: there are no more now. */
export interface Page {
  records: RunRecord[];
  next: number | null;
}

export type ReadPage = (after: number, limit: number) => Promise<Page>;

/** Kept for the log. */
const KEPT = 20_000;
const PAGE = 1000;
/** A gap that is longer is not read. */
const LONGEST_GAP = 2000;
/** A page begins with whole inputs: ask from a little earlier, what is known is dropped. */
const MARGIN = 100;

export class RecordFeed {
  private records: RunRecord[] = [];
  private skipped = 0;
  private readonly spans = new Spans();
  private waiting: RunRecord[] = [];
  private reading: Promise<void> | null = null;
  private over = false;
  private readonly shownLog = signal<LogPage>({ records: [], more: false, skipped: 0 });
  private readonly shownSpans = signal({ spans: this.spans });

  constructor(private readonly read: ReadPage) {}

  get log(): ReadonlySignal<LogPage> {
    return this.shownLog;
  }

  get timeline(): ReadonlySignal<{ spans: Spans }> {
    return this.shownSpans;
  }

  /** `count`: how many records there are. All are read, but of a very long run only the newest. */
  begin(count: number): Promise<void> {
    const from = count > KEPT ? count - PAGE - MARGIN : 0;
    return this.exclusively(() => this.readUpTo(count, from));
  }

  /** Records that were pushed, in order; maybe with a gap before them. */
  push(records: readonly RunRecord[]): void {
    this.waiting.push(...records);
    void this.exclusively(() => this.takeWaiting());
  }

  /** What is commanded now, for bars whose records were left out. */
  settle(commands: Record<string, Command>, t: number): void {
    if (this.skipped === 0 && !this.startsLate()) return;
    this.spans.settle(commands, t);
    this.shownSpans.value = { spans: this.spans };
  }

  async older(): Promise<void> {
    const first = this.records[0]?.seq ?? 1;
    if (first <= 1) return;
    const found: RunRecord[] = [];
    let after = Math.max(0, first - 1 - PAGE / 2);
    for (;;) {
      const page = await this.read(after, PAGE);
      found.push(...page.records.filter(({ seq }) => seq < first));
      if (page.next === null || page.next >= first - 1) break;
      after = page.next;
    }
    this.records = [...found, ...this.records];
    this.show();
  }

  dispose(): void {
    this.over = true;
  }

  private get last(): number {
    return this.records.at(-1)?.seq ?? 0;
  }

  private startsLate(): boolean {
    return (this.records[0]?.seq ?? 1) > 1;
  }

  /** One reading after the other; what comes meanwhile waits. */
  private async exclusively(action: () => Promise<void>): Promise<void> {
    while (this.reading) await this.reading;
    if (this.over) return;
    this.reading = action()
      .catch(() => undefined)
      .finally(() => {
        this.reading = null;
      });
    await this.reading;
  }

  private async takeWaiting(): Promise<void> {
    const records = this.waiting;
    this.waiting = [];
    const first = records.find(({ seq }) => seq > this.last);
    if (!first) return;
    const missing = first.seq - this.last - 1;
    if (missing > 0 && missing <= LONGEST_GAP) {
      await this.readUpTo(first.seq - 1, Math.max(0, this.last - MARGIN));
    }
    this.add(records);
    this.show();
  }

  private async readUpTo(count: number, from: number): Promise<void> {
    let after = from;
    while (!this.over && this.last < count) {
      const page = await this.read(after, PAGE);
      this.add(page.records);
      this.show();
      if (page.next === null) break;
      after = page.next;
    }
  }

  private add(records: readonly RunRecord[]): void {
    for (const record of records) {
      if (record.seq <= this.last) continue;
      if (this.records.length > 0) this.skipped += record.seq - this.last - 1;
      this.records.push(record);
      this.spans.add(record);
    }
    if (this.records.length > KEPT * 1.2) this.records = this.records.slice(-KEPT);
  }

  private show(): void {
    this.shownLog.value = {
      records: this.records,
      more: this.startsLate(),
      skipped: this.skipped,
    };
    this.shownSpans.value = { spans: this.spans };
  }
}
