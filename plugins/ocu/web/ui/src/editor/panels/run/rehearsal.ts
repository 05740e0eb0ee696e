// The rehearsal of one mission: what is scripted, and what came of it.
import { computed, signal } from "@preact/signals";
import { get } from "../../../shared/api";
import { toast } from "../../../shared/Toasts";
import type { Requirement, RunRecord, RunSummary } from "../../../shared/types";
import { fill, strings } from "../../../strings";
import { apply, emptyView } from "../../../records/runView";
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

const words = strings.run.answers;

const PAGE = 5000;
/** More is seen on the page of the rehearsal. */
const MOST_RECORDS = 50_000;
/** The server takes no longer text. */
const LONGEST = 1_000_000;

/** What was read of the records of a rehearsal. */
export interface Read {
  spans: readonly Span[];
  unsaid: Unsaid;
  requirements: Readonly<Record<string, Requirement>>;
  /** How many records; less than all if there are very many. */
  count: number;
}

const NOTHING: Read = { spans: [], unsaid: new Unsaid(), requirements: {}, count: 0 };

interface RecordPage {
  records: RunRecord[];
  next: number | null;
}

export class Rehearsal {
  readonly script = signal<Script>(EMPTY);
  /** The text of an answers file in place of the form; null: what the form says. */
  readonly raw = signal<string | null>(null);
  /** The name of the file that the text is of; "": it was typed. */
  readonly file = signal("");
  /** Whether the form, or the text, is unfolded. */
  readonly isUnfolded = signal(false);
  /** Why the form cannot show that text; null: it was not asked for, or it can. */
  readonly unread = signal<string | null>(null);
  readonly job = new Job<RehearsalTold>("/rehearsals");
  /** The text that it began with. */
  readonly sent = signal("");
  readonly read = signal(NOTHING);
  readonly isReady = computed(() => this.raw.value !== null || isComplete(this.script.value));

  text(): string {
    return this.raw.value ?? yamlOf(this.script.value);
  }

  /** From now on the text counts. */
  write(text: string, file = ""): void {
    this.raw.value = text;
    this.file.value = file;
    this.unread.value = null;
  }

  /** Rehearses with an answers file. */
  async open(editor: EditorContext, file: File): Promise<void> {
    let text;
    try {
      text = new TextDecoder("utf-8", { fatal: true }).decode(await file.arrayBuffer());
    } catch (error) {
      const reason = error instanceof TypeError ? words.noText : String(error);
      toast(fill(words.noFile, { file: file.name, reason }), "bad");
      return;
    }
    if (text.length > LONGEST) {
      toast(fill(words.noFile, { file: file.name, reason: words.tooLong }), "bad");
      return;
    }
    this.write(text, file.name);
    this.isUnfolded.value = true;
    await this.begin(editor);
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
      this.file.value = "";
      this.unread.value = null;
    } catch (error) {
      if (!(error instanceof Unread)) throw error;
      this.unread.value = error.message;
    }
  }

  async begin(editor: EditorContext): Promise<void> {
    if (this.job.isBusy.value) return;
    this.read.value = NOTHING;
    const answers = this.text();
    this.sent.value = answers;
    const told = await this.job.run(async () => ({
      xml: await editor.xml(),
      mission: editor.mission,
      ...beginningOf(editor).request(),
      ...(answers.trim() ? { answers } : {}),
    }));
    if (told?.state === "done") await this.readRecords(this.job.id.value);
  }

  private async readRecords(id: string): Promise<void> {
    const spans = new Spans();
    const unsaid = new Unsaid();
    const view = emptyView();
    let after: number | null = 0;
    for (let count = 0; after !== null && count < MOST_RECORDS; count += PAGE) {
      const path = `/rehearsals/${encodeURIComponent(id)}/records?after=${after}&limit=${PAGE}`;
      const page: RecordPage = await get<RecordPage>(path);
      page.records.forEach((record) => {
        spans.add(record);
        unsaid.add(record);
        apply(view, record);
      });
      after = page.next;
    }
    if (this.job.id.value !== id) return;
    const requirements = Object.fromEntries(view.requirements);
    this.read.value = { spans: spans.all, unsaid, requirements, count: view.seq };
  }
}

export const rehearsalOf = (editor: EditorContext): Rehearsal =>
  keptOf(editor, "rehearsal", () => new Rehearsal());
