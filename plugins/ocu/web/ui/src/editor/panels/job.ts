// Work that the server does for minutes: it is begun once, asked after until it is over, and can be
// cancelled.
import { computed, signal } from "@preact/signals";
import { ApiError, get, post, remove } from "../../shared/api";
import type { Finding } from "../../shared/types";

export interface JobTold {
  state: "running" | "done" | "failed" | "cancelled";
  problem: string | null;
  findings: Finding[];
}

/** Why something was not done: in the server's words, with all that it found. */
export interface Refusal {
  text: string;
  findings: readonly Finding[];
}

export interface Requests {
  get<T>(path: string): Promise<T>;
  post<T>(path: string, body: unknown): Promise<T>;
  remove<T>(path: string): Promise<T>;
}

type Phase = "idle" | "starting" | "running" | "over";

const FIRST_PAUSE_MS = 150;
const LONGEST_PAUSE_MS = 1000;
/** So often in a row the server may leave a question unanswered. */
const MOST_SILENCES = 10;

export class Job<Told extends JobTold> {
  readonly phase = signal<Phase>("idle");
  readonly told = signal<Told | null>(null);
  readonly id = signal("");
  private readonly refused = signal<Refusal | null>(null);
  /** Why there is no result; null while there is no reason to say so. */
  readonly refusal = computed(() => this.refused.value ?? failureOf(this.told.value));
  readonly isBusy = computed(
    () => this.phase.value === "starting" || this.phase.value === "running",
  );

  constructor(
    private readonly path: string,
    private readonly requests: Requests = { get, post, remove },
    private readonly sleep = (ms: number) => new Promise<void>((done) => setTimeout(done, ms)),
  ) {}

  /** Begins with what `body` makes, and goes on to the end. Does nothing while it goes on already. */
  async run(body: () => Promise<unknown>): Promise<Told | null> {
    if (this.isBusy.value) return null;
    this.phase.value = "starting";
    this.told.value = null;
    this.refused.value = null;
    this.id.value = "";
    try {
      const { id } = await this.requests.post<{ id: string }>(this.path, await body());
      this.id.value = id;
      this.phase.value = "running";
      await this.follow();
    } catch (error) {
      this.refused.value = refusalOf(error);
    }
    this.phase.value = "over";
    return this.told.value;
  }

  /** What goes on ends as cancelled; `run` tells when. */
  async cancel(): Promise<void> {
    if (this.phase.value === "running") await this.requests.remove(this.at());
  }

  private async follow(): Promise<void> {
    let pause = FIRST_PAUSE_MS;
    let silences = 0;
    for (;;) {
      try {
        this.told.value = await this.requests.get<Told>(this.at());
        silences = 0;
        if (this.told.value.state !== "running") return;
      } catch (error) {
        silences += 1;
        if (error instanceof ApiError || silences > MOST_SILENCES) throw error;
      }
      await this.sleep(pause);
      pause = Math.min(pause * 1.5, LONGEST_PAUSE_MS);
    }
  }

  private at(): string {
    return `${this.path}/${encodeURIComponent(this.id.value)}`;
  }
}

export function refusalOf(error: unknown): Refusal {
  if (error instanceof ApiError) {
    return { text: error.message, findings: error.problem.findings ?? [] };
  }
  return { text: error instanceof Error ? error.message : String(error), findings: [] };
}

function failureOf(told: JobTold | null): Refusal | null {
  if (told?.state !== "failed") return null;
  return { text: told.problem ?? "", findings: told.findings };
}
