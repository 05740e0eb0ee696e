// The rehearsal of one mission: what is scripted, and what came of it.
import { computed, signal } from "@preact/signals";
import { get } from "../../../shared/api";
import type { RunRecord, RunSummary } from "../../../shared/types";
import { Spans, type Span } from "../../../records/spans";
import { beginningOf } from "../begin/beginning";
import { Job, type JobTold } from "../job";
import { keptOf } from "../kept";
import type { EditorContext } from "../panel";
import { askingTasks, commandingTasks, servingTasks } from "../drawn";
import { Unsaid } from "./unsaid";
import { EMPTY, isComplete, yamlOf, type Script } from "./answers";

export interface RehearsalTold extends JobTold {
  summary: RunSummary | null;
}

const PAGE = 5000;
/** More is seen on the page of the rehearsal. */
const MOST_RECORDS = 50_000;

interface RecordPage {
  records: RunRecord[];
  next: number | null;
}

export class Rehearsal {
  readonly script = signal<Script>(EMPTY);
  /** The text of an answers file in place of the form; null: what the form says. */
  readonly raw = signal<string | null>(null);
  /** Why the form cannot show that text; null: it was not asked for, or it can. */
  readonly unread = signal<string | null>(null);
  readonly job = new Job<RehearsalTold>("/rehearsals");
  readonly spans = signal<readonly Span[]>([]);
  readonly unsaid = signal(new Unsaid());
  readonly isReady = computed(() => this.raw.value !== null || isComplete(this.script.value));

  text(): string {
    return this.raw.value ?? yamlOf(this.script.value);
  }

  /** From now on the text counts. */
  write(text: string): void {
    this.raw.value = text;
    this.unread.value = null;
  }

  /** Reads the text back into the form; it stays where the form cannot show all of it. */
  async readBack(editor: EditorContext): Promise<void> {
    const ids = (tasks: readonly { id: string }[]) => new Set(tasks.map(({ id }) => id));
    // Few need it: it comes with the library that reads YAML.
    const { scriptOf, Unread } = await import("./readAnswers");
    try {
      this.script.value = scriptOf(this.raw.value ?? "", {
        asking: ids(askingTasks(editor)),
        serving: ids(servingTasks(editor)),
        commanding: ids(commandingTasks(editor)),
      });
      this.raw.value = null;
      this.unread.value = null;
    } catch (error) {
      if (!(error instanceof Unread)) throw error;
      this.unread.value = error.message;
    }
  }

  async begin(editor: EditorContext): Promise<void> {
    this.spans.value = this.job.isBusy.value ? this.spans.value : [];
    const answers = this.text();
    const told = await this.job.run(async () => ({
      xml: await editor.xml(),
      mission: editor.mission,
      ...beginningOf(editor).request(),
      ...(answers.trim() ? { answers } : {}),
    }));
    if (told?.state === "done") await this.readSpans(this.job.id.value);
  }

  private async readSpans(id: string): Promise<void> {
    const spans = new Spans();
    const unsaid = new Unsaid();
    let after: number | null = 0;
    for (let count = 0; after !== null && count < MOST_RECORDS; count += PAGE) {
      const path = `/rehearsals/${encodeURIComponent(id)}/records?after=${after}&limit=${PAGE}`;
      const page: RecordPage = await get<RecordPage>(path);
      page.records.forEach((record) => {
        spans.add(record);
        unsaid.add(record);
      });
      after = page.next;
    }
    if (this.job.id.value !== id) return;
    this.spans.value = spans.all;
    this.unsaid.value = unsaid;
  }
}

export const rehearsalOf = (editor: EditorContext): Rehearsal =>
  keptOf(editor, "rehearsal", () => new Rehearsal());
