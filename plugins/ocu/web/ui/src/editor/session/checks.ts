// What `m2pem check` says of the mission, while it is drawn.
import { signal } from "@preact/signals";
import type { Check, Finding, Outline } from "../../shared/types";

const PAUSE_MS = 400;

type State = "waiting" | "checking" | "checked" | "failed";

export class Checks {
  readonly findings = signal<readonly Finding[]>([]);
  readonly outline = signal<Outline | null>(null);
  readonly state = signal<State>("waiting");
  private timer: ReturnType<typeof setTimeout> | undefined;
  /** Of the newest question: answers to older ones do not count. */
  private asked = 0;

  constructor(
    private readonly xml: () => Promise<string>,
    private readonly ask: (xml: string) => Promise<Check>,
    private readonly pauseMs = PAUSE_MS,
  ) {}

  /** The mission has changed. */
  soon(): void {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => void this.now(), this.pauseMs);
  }

  async now(): Promise<void> {
    clearTimeout(this.timer);
    const mine = ++this.asked;
    this.state.value = "checking";
    try {
      const { findings, outline } = await this.ask(await this.xml());
      if (mine !== this.asked) return;
      this.findings.value = findings;
      if (outline) this.outline.value = outline;
      this.state.value = "checked";
    } catch {
      if (mine === this.asked) this.state.value = "failed";
    }
  }

  end(): void {
    clearTimeout(this.timer);
    this.asked += 1;
  }

  /** Resolves with what is in the mission, once that is known. */
  known(): Promise<Outline> {
    return new Promise((resolve) => {
      const left = this.outline.subscribe((found) => {
        if (!found) return;
        resolve(found);
        queueMicrotask(() => left());
      });
    });
  }

  of(element: string): Finding[] {
    return this.findings.value.filter((each) => each.element === element);
  }
}
