// Work on one mission: what the server has, what is drawn here, and how the two come together.
import { signal } from "@preact/signals";
import { ApiError } from "../../shared/api";
import { go } from "../../shared/router";
import { may } from "../../shared/session";
import { toast } from "../../shared/Toasts";
import { fill, strings } from "../../strings";
import { comparing } from "../../compare/comparing";
import { Autosave } from "./Autosave";
import type { Catalogue } from "./catalogue";
import { dropDraft, readDraft, type Draft } from "./drafts";
import { EditorSession } from "./EditorSession";
import {
  makeEditable,
  openMission,
  openVersion,
  saveMission,
  versionsOf,
  type SavedVersion,
} from "../../missions/files";

const words = strings.editor;

export type Question =
  | { kind: "conflict"; current: SavedVersion | null }
  | { kind: "recovery"; draft: Draft; isOlder: boolean }
  | { kind: "versions" }
  | { kind: "saveAs" }
  | { kind: "layout" }
  | { kind: "shortcuts" };

export class MissionWork {
  readonly session: EditorSession;
  readonly question = signal<Question | null>(null);
  readonly notes = signal<readonly string[]>([]);
  readonly saved = signal<SavedVersion | null>(null);
  readonly isSaving = signal(false);
  /** Brings back what was drawn before something else was put in its place; `text` says what. */
  readonly putBack = signal<{ text: string; act: () => Promise<void> } | null>(null);
  private readonly autosave: Autosave;

  constructor(
    readonly mission: string,
    catalogue: Catalogue,
  ) {
    this.session = new EditorSession(mission, catalogue, () => this.save());
    this.autosave = new Autosave(
      mission,
      () => this.session.xml(),
      () => this.saved.value?.version ?? null,
    );
    this.session.changes.subscribe(() => {
      // It would take back what was drawn since, too.
      this.putBack.value = null;
      if (this.session.isDirty.peek()) this.autosave.soon();
    });
  }

  /** Draws what the server has, and asks what to do with a draft that was not saved. */
  async begin(): Promise<void> {
    const draft = await readDraft(this.mission).catch(() => undefined);
    const file = await openMission(this.mission);
    this.saved.value = file;
    this.notes.value = file.notes;
    await this.session.open(file.xml, true);
    if (draft && draft.xml !== (await this.session.xml())) {
      this.question.value = { kind: "recovery", draft, isOlder: draft.base !== file.version };
    }
  }

  async recover(draft: Draft): Promise<void> {
    await this.session.open(draft.xml, false);
    // Somebody's newer version is not overwritten unasked.
    if (this.saved.value && draft.base)
      this.saved.value = { ...this.saved.value, version: draft.base };
  }

  discardDraft(): void {
    this.autosave.drop();
  }

  async save(): Promise<boolean> {
    if (!may("commander")) {
      toast(words.viewerHint, "bad");
      return false;
    }
    if (!this.session.isDirty.peek() && this.saved.peek()) return true;
    return this.put(this.mission, this.saved.peek()?.version ?? null);
  }

  /** What was saved last beside what is drawn here; if that is the same, beside the one before. */
  async compare(): Promise<void> {
    try {
      const all = await versionsOf(this.mission);
      const last = all.at(-1)?.number;
      if (last === undefined) return toast(words.versions.none);
      const isDirty = this.session.isDirty.peek();
      const [before, after] = isDirty ? [last, "drawn" as const] : [Math.max(1, last - 1), last];
      comparing.value = { before, after };
    } catch {
      toast(words.versions.failed, "bad");
    }
  }

  /** What another user saved meanwhile beside what is drawn here. The question stays open. */
  async compareTheirs(): Promise<void> {
    try {
      const last = (await versionsOf(this.mission)).at(-1)?.number;
      if (last !== undefined) comparing.value = { before: last, after: "drawn" };
    } catch {
      toast(words.versions.failed, "bad");
    }
  }

  /** Over a version that another user saved: theirs is kept as an older one. */
  async overwrite(current: SavedVersion | null): Promise<boolean> {
    return this.put(this.mission, current?.version ?? null);
  }

  /** Under a name that is free: the page goes there. */
  async saveAs(name: string): Promise<boolean> {
    if (!(await this.put(name, null))) return false;
    await dropDraft(this.mission).catch(() => undefined);
    go(`/missions/${encodeURIComponent(name)}`);
    return true;
  }

  /** What is drawn here can be brought back, and stays a draft of this browser until then. */
  async takeTheirs(): Promise<void> {
    const mine = await this.session.xml();
    const base = this.saved.peek();
    const file = await openMission(this.mission);
    this.saved.value = file;
    this.notes.value = file.notes;
    await this.session.open(file.xml, true);
    this.putBack.value = {
      text: words.conflict.taken,
      act: async () => {
        await this.session.open(mine, false);
        if (base) this.saved.value = base;
      },
    };
  }

  async openVersion(number: number): Promise<void> {
    const { xml } = await openVersion(this.mission, number);
    await this.session.open(xml, false);
    toast(fill(words.versions.opened, { number }));
  }

  /** Another file in place of this mission; it is saved only when the user says so. */
  async replaceBy(name: string, content: string): Promise<void> {
    try {
      const { xml, notes } = await makeEditable(content);
      await this.session.open(xml, false);
      this.notes.value = notes;
      toast(fill(words.file.replaced, { name }));
    } catch (error) {
      const reason = error instanceof Error ? error.message : String(error);
      toast(fill(words.unreadable, { reason }), "bad");
    }
  }

  /** New places for everything. */
  async layOut(): Promise<void> {
    const before = await this.session.xml();
    const { xml } = await makeEditable(before, true);
    await this.session.open(xml, false);
    this.putBack.value = {
      text: words.file.laidOut,
      act: () => this.session.open(before, false),
    };
  }

  end(): void {
    this.autosave.end();
    this.session.end();
  }

  private async put(name: string, base: string | null): Promise<boolean> {
    this.isSaving.value = true;
    try {
      const outcome = await saveMission(name, await this.session.xml(), base);
      if (outcome.kind === "conflict") {
        this.question.value = { kind: "conflict", current: outcome.current };
        return false;
      }
      this.saved.value = outcome.saved;
      this.session.saved();
      this.autosave.drop();
      toast(words.saved, "good");
      return true;
    } catch (error) {
      toast(error instanceof ApiError ? error.message : strings.home.failed, "bad");
      return false;
    } finally {
      this.isSaving.value = false;
    }
  }
}
