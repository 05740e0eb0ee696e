// The start of a run: what is drawn is saved first, and it is started once.
import { signal } from "@preact/signals";
import { ApiError, get } from "../../../shared/api";
import { start } from "../../../shared/command";
import type { MissionFile } from "../../../shared/types";
import { beginningOf } from "../begin/beginning";
import { refusalOf, type Refusal } from "../job";
import { keptOf } from "../kept";
import type { EditorContext } from "../panel";

/** `holders`: the run or operator that has each. `request`: what was asked for. */
export interface Busy {
  holders: Record<string, string>;
  request: object;
}

export class Starting {
  readonly isBusy = signal(false);
  readonly refusal = signal<Refusal | null>(null);
  /** Who has vehicles that the mission needs; null: it was not refused so. */
  readonly busy = signal<Busy | null>(null);

  /** The run that began; undefined: none did, or another start goes on. */
  async start(editor: EditorContext, evenIfBusy = false): Promise<string | undefined> {
    if (this.isBusy.peek()) return undefined;
    this.isBusy.value = true;
    this.refusal.value = null;
    this.busy.value = null;
    let request = {};
    try {
      if (!(await editor.save())) return undefined;
      const { mission } = editor;
      const { version } = await get<MissionFile>(`/missions/${encodeURIComponent(mission)}`);
      const begins = beginningOf(editor).request();
      request = { mission, version, ...begins };
      const asked = { ...request, even_if_busy: evenIfBusy };
      return (await start<{ run: string }>("/runs", asked)).run;
    } catch (error) {
      if (error instanceof ApiError && error.problem.busy)
        this.busy.value = { holders: error.problem.busy as Record<string, string>, request };
      else this.refusal.value = refusalOf(error);
      return undefined;
    } finally {
      this.isBusy.value = false;
    }
  }
}

export const startingOf = (editor: EditorContext): Starting =>
  keptOf(editor, "starting", () => new Starting());
