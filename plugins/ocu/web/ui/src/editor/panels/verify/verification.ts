// The verification of one mission: what is asked, how far it is, and the report with the mission
// that it was made of.
import { signal } from "@preact/signals";
import { beginningOf } from "../begin/beginning";
import { Job, type JobTold } from "../job";
import { keptOf } from "../kept";
import type { EditorContext } from "../panel";
import { meaningOf, type Outcome, type Report, type Violation } from "./report";
import { walkOf } from "./walk";

export interface VerificationTold extends JobTold {
  progress: {
    seconds: number;
    states: number;
    waiting: number;
    memory_mb: number;
    /** By property or requirement, its verdict, if that is certain already. */
    decided: Record<string, Outcome>;
  };
  report: Report | null;
}

export interface Made {
  report: Report;
  /** Of the mission that it was made of. */
  meaning: string;
}

export class Verification {
  readonly strict = signal(false);
  readonly inOrder = signal(false);
  readonly exhaustive = signal(false);
  /** More requirements, as the text of a YAML file. */
  readonly spec = signal("");
  /** What all runs are taken to do, such as "no-failures". */
  readonly assume = signal("");
  readonly allPools = signal(false);
  readonly job = new Job<VerificationTold>("/verifications");
  readonly made = signal<Made | null>(null);
  readonly isStale = signal(false);
  /** The violation that is looked at, and after which of its steps. */
  readonly opened = signal<Violation | null>(null);
  readonly step = signal(0);
  /** The property that somebody wants to see; "": none. */
  readonly pointed = signal("");

  async begin(editor: EditorContext): Promise<void> {
    let meaning = "";
    const told = await this.job.run(async () => {
      const xml = await editor.xml();
      meaning = meaningOf(xml);
      return {
        xml,
        mission: editor.mission,
        ...beginningOf(editor).request(),
        ...(this.spec.value.trim() ? { spec: this.spec.value } : {}),
        strict: this.strict.value,
        ...(this.exhaustive.value ? { exhaustive: true } : {}),
        ...(this.inOrder.value ? { timers: "in-order" } : {}),
        ...(this.assume.value.trim() ? { assume: [this.assume.value] } : {}),
        ...(this.allPools.value ? { all_pools: true } : {}),
      };
    });
    if (told?.state !== "done" || !told.report) return;
    this.clear();
    this.made.value = { report: told.report, meaning };
    await this.compare(editor);
  }

  /** Whether what is drawn now still means what was verified. */
  async compare(editor: EditorContext): Promise<void> {
    const made = this.made.value;
    if (!made) return;
    const now = meaningOf(await editor.xml());
    if (this.made.value === made) this.isStale.value = now !== made.meaning;
  }

  clear(): void {
    this.opened.value = null;
    this.made.value = null;
    this.isStale.value = false;
  }

  /** Looks at how a violation ends: from there one steps back. */
  open(violation: Violation): void {
    this.opened.value = violation;
    this.step.value = Math.max(0, walkOf(violation).steps.length - 1);
  }

  goTo(step: number): void {
    const violation = this.opened.value;
    if (!violation) return;
    const last = walkOf(violation).steps.length - 1;
    this.step.value = Math.max(0, Math.min(step, last));
  }
}

export const verificationOf = (editor: EditorContext): Verification =>
  keptOf(editor, "verification", () => new Verification());
