// One quantity of one vehicle or payload over mission time, as columns. NaN: not known from here on.

/** Values that a series has at most; a longer one keeps the least and the greatest of each few. */
export const MOST_VALUES = 20_000;
/** Values that are replaced by two of them. */
const MERGED = 4;

export class Series {
  private times_s = new Float64Array(64);
  private values = new Float64Array(64);
  private count = 0;

  constructor(private readonly most = MOST_VALUES) {}

  get length(): number {
    return this.count;
  }

  timeAt(index: number): number {
    return this.times_s[index]!;
  }

  valueAt(index: number): number {
    return this.values[index]!;
  }

  /** Add a value at a time that is not before the last one; NaN begins a gap. */
  push(t_s: number, value: number): void {
    if (this.count > 0 && t_s < this.times_s[this.count - 1]!) return;
    if (Number.isNaN(value) && (this.count === 0 || Number.isNaN(this.values[this.count - 1]))) {
      return;
    }
    if (this.count >= this.most) this.thin();
    if (this.count === this.times_s.length) this.grow();
    this.times_s[this.count] = t_s;
    this.values[this.count] = value;
    this.count += 1;
  }

  /** How many values there are up to and at a time. */
  countAt(t_s: number): number {
    let [low, high] = [0, this.count];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.times_s[middle]! <= t_s) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /** The value that holds at a time; null: none is known there. */
  at(t_s: number): number | null {
    const value = this.values[this.countAt(t_s) - 1];
    return value === undefined || Number.isNaN(value) ? null : value;
  }

  private grow(): void {
    const [times_s, values] = [this.times_s, this.values];
    this.times_s = new Float64Array(this.count * 2);
    this.values = new Float64Array(this.count * 2);
    this.times_s.set(times_s);
    this.values.set(values);
  }

  private thin(): void {
    let kept = 0;
    const keep = (index: number) => {
      this.times_s[kept] = this.times_s[index]!;
      this.values[kept] = this.values[index]!;
      kept += 1;
    };
    for (let from = 0; from < this.count; from += MERGED) {
      for (const index of extremes(this, from, Math.min(this.count, from + MERGED))) keep(index);
    }
    this.count = kept;
  }
}

/**
 * Of the values from one index up to another: where the least and the greatest are, in order of time,
 * and where a gap begins, if there is one.
 */
export function extremes(series: Series, from: number, to: number): number[] {
  let least = -1;
  let greatest = -1;
  let gap = -1;
  let lowest = Infinity;
  let highest = -Infinity;
  for (let index = from; index < to; index += 1) {
    const value = series.valueAt(index);
    if (value < lowest) {
      lowest = value;
      least = index;
    }
    if (value > highest) {
      highest = value;
      greatest = index;
    }
    if (value !== value) gap = index; // NaN
  }
  const found: number[] = [];
  const [first, last] = least < greatest ? [least, greatest] : [greatest, least];
  // Without a value, both are -1; with one, they are the same.
  if (gap >= 0 && gap < first) found.push(gap);
  if (first >= 0) found.push(first);
  if (gap > first && gap < last) found.push(gap);
  if (last > first) found.push(last);
  if (gap > last) found.push(gap);
  return found;
}

export interface Range {
  from_s: number;
  to_s: number;
}

/** What a chart draws: `null` is a gap, `undefined` is passed over. */
export type Drawn = number | null | undefined;

/** Times for `columns` columns of a chart: three in each, for the least, the greatest and a gap. */
export function grid({ from_s, to_s }: Range, columns: number): number[] {
  const step_s = (to_s - from_s) / (columns * PER_COLUMN);
  return Array.from({ length: columns * PER_COLUMN + 1 }, (_, index) => from_s + index * step_s);
}

const PER_COLUMN = 3;

/** The values of a series on that grid. Lines come in from the left, and leave to the right. */
export function drawn(series: Series, { from_s, to_s }: Range, columns: number): Drawn[] {
  const values: Drawn[] = new Array<Drawn>(columns * PER_COLUMN + 1).fill(undefined);
  const first = series.countAt(from_s);
  const end = series.countAt(to_s);
  const column_s = (to_s - from_s) / columns;
  let from = first;
  for (let column = 0; column < columns && from < end; column += 1) {
    const until_s = from_s + (column + 1) * column_s;
    const to = Math.min(end, series.countAt(until_s));
    if (to === from) continue;
    let place = column * PER_COLUMN;
    for (const index of extremes(series, from, to)) {
      const value = series.valueAt(index);
      values[place] = Number.isNaN(value) ? null : value;
      place += 1;
    }
    from = to;
  }
  values[0] = between(series, first, from_s) ?? values[0];
  const right = between(series, end, to_s);
  if (right !== null) values[values.length - 1] = right;
  return values;
}

/** The value at a time before which there are `count`, on the line between two of them. */
function between(series: Series, count: number, t_s: number): number | null {
  if (count === 0 || count >= series.length) return null;
  const [before, after] = [series.valueAt(count - 1), series.valueAt(count)];
  if (Number.isNaN(before) || Number.isNaN(after)) return null;
  const [from_s, to_s] = [series.timeAt(count - 1), series.timeAt(count)];
  return to_s > from_s ? before + ((after - before) * (t_s - from_s)) / (to_s - from_s) : after;
}
