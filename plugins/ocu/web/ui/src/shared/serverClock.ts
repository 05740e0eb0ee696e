// The executive's clock, as far as it is known from the stream. It is monotonic, and so is the
// clock of this page: neither has to be set.

/** How much the two clocks may drift apart, at most. */
const DRIFT = 0.001;

export class ServerClock {
  private offset_s: number | null = null;
  private at_s = 0;

  constructor(private readonly own_s: () => number = () => performance.now() / 1000) {}

  /** A message says what time it was when it was sent. The one that was fastest knows best. */
  heard(now_s: number): void {
    const own = this.own_s();
    const offset = now_s - own;
    const known = this.offset_s === null ? offset : this.offset_s - (own - this.at_s) * DRIFT;
    this.offset_s = Math.max(offset, known);
    this.at_s = own;
  }

  /** On a new connection, which may be to another executive. */
  forget(): void {
    this.offset_s = null;
  }

  /** Seconds; null: not known. */
  now(): number | null {
    return this.offset_s === null ? null : this.own_s() + this.offset_s;
  }
}
