// The comments on a mission: read again when any page has changed them.
import { effect, signal } from "@preact/signals";
import { get, remove } from "../shared/api";
import { command } from "../shared/command";
import { commentChanges } from "../shared/executive";
import { toast } from "../shared/Toasts";
import type { MissionComment } from "./threads";

const path = (mission: string) => `/missions/${encodeURIComponent(mission)}/comments`;

/** Of the mission that is shown. */
export const comments = signal<readonly MissionComment[]>([]);

/** Keeps `comments` those of a mission; what is returned ends it. */
export function followComments(mission: string): () => void {
  let ended = false;
  const load = async () => {
    try {
      const found = await get<MissionComment[]>(path(mission));
      if (!ended) comments.value = found;
    } catch {
      // The next change, or the next connection, reads them again.
    }
  };
  const stop = effect(() => {
    const { mission: changed } = commentChanges.value;
    if (changed === "" || changed === mission) void load();
  });
  return () => {
    ended = true;
    stop();
    comments.value = [];
  };
}

export const write = (
  mission: string,
  said: { text: string; element?: string; label?: string; parent?: number },
): Promise<boolean> => command(path(mission), said);

export const resolve = (mission: string, id: number, resolved: boolean): Promise<boolean> =>
  command(`${path(mission)}/${id}/resolve`, { resolved });

export async function drop(mission: string, id: number): Promise<void> {
  try {
    await remove(`${path(mission)}/${id}`);
  } catch (error) {
    toast(error instanceof Error ? error.message : String(error), "bad");
  }
}
