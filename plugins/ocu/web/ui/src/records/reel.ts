// All records of a run that is over, and the view after any number of them. Going back is cheap:
// a view is kept every few thousand records.
import type { RunRecord } from "../shared/types";
import { apply, copy, emptyView, type RunView } from "./runView";

const KEPT_EVERY = 2000;

export class Reel {
  private readonly kept: RunView[] = [emptyView()];
  private current = emptyView();
  private at = 0;

  constructor(readonly records: readonly RunRecord[]) {}

  get length(): number {
    return this.records.length;
  }

  /** Mission time of the last record, in seconds. */
  get end(): number {
    return this.records.at(-1)?.t ?? 0;
  }

  /** How many records there are up to and at a mission time. */
  countAt(t: number): number {
    let low = 0;
    let high = this.records.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.records[middle]!.t <= t) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /** After the first `count` records. Valid until it is asked for again. */
  after(count: number): RunView {
    const wanted = Math.max(0, Math.min(count, this.records.length));
    if (wanted < this.at || Math.floor(wanted / KEPT_EVERY) > Math.floor(this.at / KEPT_EVERY)) {
      this.jump(wanted);
    }
    while (this.at < wanted) this.advance();
    return this.current;
  }

  private jump(wanted: number): void {
    const known = Math.min(Math.floor(wanted / KEPT_EVERY), this.kept.length - 1);
    if (known * KEPT_EVERY <= this.at && this.at <= wanted) return;
    this.current = copy(this.kept[known]!);
    this.at = known * KEPT_EVERY;
  }

  private advance(): void {
    apply(this.current, this.records[this.at]!);
    this.at += 1;
    if (this.at === this.kept.length * KEPT_EVERY) this.kept.push(copy(this.current));
  }
}
