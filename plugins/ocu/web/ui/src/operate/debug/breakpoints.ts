// Breakpoints of a run: which elements have one, and how these are marked.
import type { Debugging } from "../../shared/types";
import { strings } from "../../strings";
import type { MissionModel, MissionNode } from "../mission/missionModel";
import { keyOf } from "../mission/names";

const text = strings.debug;

/** What tells marks without a colour. */
export const BREAKPOINT = "●";
export const NEXT = "▶";

/** How an element is marked: `next`: the run is stopped before it. */
export interface Mark {
  breakpoint: boolean;
  next: boolean;
}

/** By the keys of elements (`keyOf`). */
export type Marks = ReadonlyMap<string, Mark>;

type Nodes = Pick<MissionModel, "nodesOf">;

/** The elements that have a breakpoint, as far as the diagrams have them. */
export const placesOf = (ids: readonly string[], mission: Nodes): readonly MissionNode[] =>
  ids.flatMap((id) => mission.nodesOf(id).filter(({ type }) => type !== "Process"));

export function marksIn(debugging: Debugging | null, mission: Nodes): Marks {
  const marks = new Map<string, Mark>();
  if (!debugging) return marks;
  for (const { process, id } of placesOf(debugging.elements, mission)) {
    marks.set(keyOf(process, id), { breakpoint: true, next: false });
  }
  const { reached } = debugging;
  if (reached?.element) {
    const key = keyOf(reached.process, reached.element);
    marks.set(key, { breakpoint: marks.has(key), next: true });
  }
  return marks;
}

export const signOf = (mark: Mark | undefined): string =>
  mark ? (mark.next ? NEXT : BREAKPOINT) : "";

/** A mark in words; "": there is none. */
export const markInWords = (mark: Mark | undefined): string =>
  [mark?.breakpoint && text.breakpoint, mark?.next && text.next].filter(Boolean).join(", ");

export interface Breakpoints {
  elements: readonly string[];
  conditions: readonly string[];
}

export const breakpointsOf = (debugging: Debugging | null): Breakpoints => ({
  elements: debugging?.elements ?? [],
  conditions: debugging?.conditions ?? [],
});

/** With one more, or without it if it is there. */
export const turned = (all: readonly string[], one: string): string[] =>
  all.includes(one) ? all.filter((each) => each !== one) : [...all, one];
