// Comments on the elements of a mission, as the server keeps them, in threads.
export interface MissionComment {
  id: number;
  /** "": the mission as a whole. */
  element: string;
  /** What the element was called. */
  label: string;
  text: string;
  by: string;
  at_us: number;
  /** The comment that it answers; 0: none. */
  parent: number;
  version: string;
  /** "": it is open. */
  resolved_by: string;
  resolved_us: number;
}

export interface Thread {
  first: MissionComment;
  answers: MissionComment[];
}

/** Those about the chosen element first, then the open ones, the newest first. */
export function threadsOf(all: readonly MissionComment[], chosen: string): Thread[] {
  const threads = all
    .filter(({ parent }) => parent === 0)
    .map((first) => ({ first, answers: all.filter(({ parent }) => parent === first.id) }));
  const rank = ({ first }: Thread) =>
    (first.element === chosen && chosen !== "" ? 0 : 2) + (first.resolved_by ? 1 : 0);
  return threads.sort((one, other) => rank(one) - rank(other) || other.first.id - one.first.id);
}

/** How many open comments each element has. */
export function openByElement(all: readonly MissionComment[]): Map<string, number> {
  const found = new Map<string, number>();
  for (const { element, parent, resolved_by } of all) {
    if (parent !== 0 || resolved_by || !element) continue;
    found.set(element, (found.get(element) ?? 0) + 1);
  }
  return found;
}
