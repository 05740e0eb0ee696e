// Keeps a draft of a mission while it is drawn. A browser that keeps nothing does not stop anybody.
import { dropDraft, writeDraft } from "./drafts";

const PAUSE_MS = 800;

export class Autosave {
  private timer: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly mission: string,
    private readonly xml: () => Promise<string>,
    private readonly base: () => string | null,
  ) {}

  soon(): void {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => void this.now(), PAUSE_MS);
  }

  /** All is saved, or thrown away. */
  drop(): void {
    clearTimeout(this.timer);
    dropDraft(this.mission).catch(() => undefined);
  }

  end(): void {
    clearTimeout(this.timer);
  }

  private async now(): Promise<void> {
    try {
      const draft = { mission: this.mission, base: this.base(), at: Date.now() };
      await writeDraft({ ...draft, xml: await this.xml() });
    } catch {
      // Storage may be full or forbidden; the mission itself can still be saved.
    }
  }
}
