// What the diagram shows of a run that breaks a property, after any number of its steps.
import type { Step, Violation } from "./report";

export interface Walk {
  steps: readonly Step[];
  /** How many of the steps come before those that repeat for ever. */
  before: number;
}

export interface Frame {
  /** CSS classes by element. */
  classes: Record<string, string>;
  /** By element, the numbers of the steps that begin there; of those that repeat, with a mark. */
  numbers: Map<string, { step: number; repeats: boolean; now: boolean }[]>;
  /** Elements that are stuck, or where what is wrong is. */
  stuck: string[];
}

export function walkOf({ steps, loop }: Violation): Walk {
  return { steps: [...steps, ...loop], before: steps.length };
}

/** After the step at `index`; -1, or the last: how it ends. */
export function frameAt(violation: Violation, index: number): Frame {
  const walk = walkOf(violation);
  const last = walk.steps.length - 1;
  const at = index < 0 ? last : Math.min(index, last);
  const marks = new Map<string, Set<string>>();
  const mark = (element: string, name: string) => {
    if (!element) return;
    if (!marks.has(element)) marks.set(element, new Set());
    marks.get(element)!.add(name);
  };

  const numbers: Frame["numbers"] = new Map();
  walk.steps.slice(0, at + 1).forEach((step, position) => {
    const now = position === at;
    for (const element of step.passes) {
      mark(element, "m2v-passed");
      if (position >= walk.before) mark(element, "m2v-repeats");
      if (now) mark(element, "m2v-now");
    }
    const first = step.passes[0] ?? step.element;
    if (!first) return;
    const there = numbers.get(first) ?? [];
    there.push({ step: step.step, repeats: position >= walk.before, now });
    numbers.set(first, there);
  });
  const ends = at === last;
  const tokens = ends ? violation.tokens : (walk.steps[at]?.tokens ?? []);
  for (const { element, waits } of tokens) {
    mark(element, "m2v-token");
    if (waits) mark(element, "m2v-waits");
  }
  if (ends) {
    for (const element of violation.elements) mark(element, "m2v-stuck");
    for (const flow of violation.missing) mark(flow, "m2v-missing");
  }
  const classes = Object.fromEntries([...marks].map(([id, names]) => [id, [...names].join(" ")]));
  return { classes, numbers, stuck: ends ? violation.elements : [] };
}

/** The data that a step changed, as it is then. */
export function changedData(walk: Walk, index: number): [name: string, value: unknown][] {
  const now = walk.steps[index]?.data ?? {};
  const before = walk.steps[index - 1]?.data ?? {};
  return Object.entries(now).filter(
    ([name, value]) => JSON.stringify(value) !== JSON.stringify(before[name] ?? null),
  );
}
