// The start of a run: what is drawn is saved first, and it is started once.
import { signal } from "@preact/signals";
import { get } from "../../../shared/api";
import { start } from "../../../shared/command";
import type { MissionFile } from "../../../shared/types";
import { beginningOf } from "../begin/beginning";
import { refusalOf, type Refusal } from "../job";
import { keptOf } from "../kept";
import type { EditorContext } from "../panel";

export class Starting {
  readonly isBusy = signal(false);
  readonly refusal = signal<Refusal | null>(null);

  /** The run that began; undefined: none did, or another start goes on. */
  async start(editor: EditorContext): Promise<string | undefined> {
    if (this.isBusy.peek()) return undefined;
    this.isBusy.value = true;
    this.refusal.value = null;
    try {
      if (!(await editor.save())) return undefined;
      const { mission } = editor;
      const { version } = await get<MissionFile>(`/missions/${encodeURIComponent(mission)}`);
      const request = { mission, version, ...beginningOf(editor).request() };
      return (await start<{ run: string }>("/runs", request)).run;
    } catch (error) {
      this.refusal.value = refusalOf(error);
      return undefined;
    } finally {
      this.isBusy.value = false;
    }
  }
}

export const startingOf = (editor: EditorContext): Starting =>
  keptOf(editor, "starting", () => new Starting());
