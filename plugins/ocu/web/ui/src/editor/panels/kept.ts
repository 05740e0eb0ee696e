// What panels know of a mission outlives the page: one looks at a rehearsal, and comes back.
import type { EditorContext } from "./panel";

const kept = new Map<string, Map<string, unknown>>();

/** What is kept under a name for the mission of this editor; made when it is first asked for. */
export function keptOf<T>(editor: EditorContext, name: string, make: () => T): T {
  const ofMission = kept.get(editor.mission) ?? new Map<string, unknown>();
  kept.set(editor.mission, ofMission);
  if (!ofMission.has(name)) ofMission.set(name, make());
  return ofMission.get(name) as T;
}
