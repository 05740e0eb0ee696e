// The records of a run that is over, by pages, and the view after any number of them. The server
// sends each page with the view before it; a bounded number of pages is kept, those used last.
import type { RunRecord } from "../shared/types";
import { apply, copy, emptyView, viewOf, type PageView, type RunView } from "./runView";

/** What a replay begins with. `times`: mission time after each full page. */
export interface ReelHead {
  records: number;
  end: number;
  page: number;
  times: readonly number[];
}

export interface ReelPage {
  view: PageView;
  records: RunRecord[];
}

export type ReadReelPage = (number: number) => Promise<ReelPage>;

interface Kept {
  before: RunView;
  records: readonly RunRecord[];
}

const MOST_PAGES = 24;

export class Reel {
  private readonly kept = new Map<number, Kept>();
  private readonly reading = new Map<number, Promise<void>>();
  private current = emptyView();
  private page = -1;
  private at = 0;

  constructor(
    private readonly head: ReelHead,
    private readonly readPage: ReadReelPage,
  ) {}

  get length(): number {
    return this.head.records;
  }

  /** Mission time of the last record, in seconds. */
  get end(): number {
    return this.head.end;
  }

  /** The page that has what there is up to and at a mission time. */
  pageAt(t: number): number {
    const { times } = this.head;
    let [low, high] = [0, times.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (times[middle]! <= t) low = middle + 1;
      else high = middle;
    }
    return Math.min(low, this.last);
  }

  /** The page of the last of so many records. */
  pageOf(count: number): number {
    return Math.max(0, Math.ceil(this.clamped(count) / this.head.page) - 1);
  }

  has(page: number): boolean {
    return this.kept.has(page);
  }

  /** Read a page, unless it is here or out of reach. */
  read(page: number): Promise<void> {
    if (page < 0 || page > this.last || this.kept.has(page)) return Promise.resolve();
    let reading = this.reading.get(page);
    if (!reading) {
      reading = this.readPage(page)
        .then(({ view, records }) => this.keep(page, { before: viewOf(view), records }))
        .finally(() => this.reading.delete(page));
      this.reading.set(page, reading);
    }
    return reading;
  }

  /** How many records there are up to and at a mission time; its page is here. */
  countAt(t: number): number {
    const page = this.pageAt(t);
    const records = this.kept.get(page)?.records ?? [];
    let [low, high] = [0, records.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (records[middle]!.t <= t) low = middle + 1;
      else high = middle;
    }
    return page * this.head.page + low;
  }

  /** The mission time of the last of so many records; its page is here. */
  timeOf(count: number): number {
    const page = this.pageOf(count);
    return this.kept.get(page)?.records[count - 1 - page * this.head.page]?.t ?? 0;
  }

  /** After the first `count` records, whose page is here. Valid until it is asked for again. */
  after(count: number, page = this.pageOf(count)): RunView {
    const kept = this.use(page);
    const wanted = this.clamped(count) - page * this.head.page;
    if (page !== this.page || wanted < this.at) {
      this.current = copy(kept.before);
      this.page = page;
      this.at = 0;
    }
    for (; this.at < wanted; this.at += 1) apply(this.current, kept.records[this.at]!);
    return this.current;
  }

  /** Up to `count` records from the first one of a page on, as far as their pages are here. */
  between(fromPage: number, count: number): RunRecord[] {
    const found: RunRecord[] = [];
    for (let page = fromPage; page * this.head.page < count; page += 1) {
      const records = this.kept.get(page)?.records;
      if (!records) break;
      const most = count - page * this.head.page;
      for (const record of most < records.length ? records.slice(0, most) : records) {
        found.push(record);
      }
    }
    return found;
  }

  private get last(): number {
    return Math.max(0, Math.ceil(this.head.records / this.head.page) - 1);
  }

  private clamped(count: number): number {
    return Math.max(0, Math.min(count, this.head.records));
  }

  private use(page: number): Kept {
    const kept = this.kept.get(page);
    if (!kept) throw new Error(`page ${page} of the replay was not read`);
    this.kept.delete(page);
    this.kept.set(page, kept);
    return kept;
  }

  private keep(page: number, kept: Kept): void {
    this.kept.set(page, kept);
    for (const oldest of this.kept.keys()) {
      if (this.kept.size <= MOST_PAGES) break;
      if (oldest !== this.page) this.kept.delete(oldest);
    }
  }
}
