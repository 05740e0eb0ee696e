// Two presses stop: the first arms, the second within three seconds does it. So does holding.
import { signal, type ReadonlySignal } from "@preact/signals";

export const ARMED_MS = 3000;
export const HOLD_MS = 900;
/** A double click is not two decisions. */
export const BETWEEN_MS = 250;

export class TwoPresses {
  private readonly state = signal(false);
  private timer: ReturnType<typeof setTimeout> | undefined;
  private armedAt = 0;

  constructor(
    private readonly act: () => void,
    private readonly now: () => number = () => performance.now(),
  ) {}

  get armed(): ReadonlySignal<boolean> {
    return this.state;
  }

  press(): void {
    if (!this.state.value) {
      this.armedAt = this.now();
      this.state.value = true;
      this.timer = setTimeout(() => this.disarm(), ARMED_MS);
    } else if (this.now() - this.armedAt >= BETWEEN_MS) {
      this.held();
    }
  }

  held(): void {
    this.disarm();
    this.act();
  }

  disarm(): void {
    clearTimeout(this.timer);
    this.state.value = false;
  }
}
