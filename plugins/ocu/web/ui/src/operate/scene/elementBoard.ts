// The states of a run's elements. Listeners get what changed at once; lists that people read
// are renewed a few times a second (`slow`).
import { signal, type ReadonlySignal } from "@preact/signals";
import { keyOf } from "../mission/names";
import type { Elements, ElementState } from "../../shared/types";

export interface ElementChange {
  process: string;
  element: string;
  state: ElementState;
  before: ElementState | undefined;
}

interface Seen {
  process: string;
  element: string;
  state: ElementState;
}

type Listener = (changes: ElementChange[]) => void;

const SLOW_MS = 200;
/** Long lists are renewed less often, as each renewal takes longer. */
const EACH_MS = 2;

const IDLE: ElementState = {
  active: 0,
  hits: 0,
  last: 0,
  failed: false,
  asking: false,
  waiting: false,
};

export class ElementBoard {
  private readonly states = new Map<string, Seen>();
  private readonly listeners = new Set<Listener>();
  private readonly version = signal(0);
  private timer: ReturnType<typeof setTimeout> | undefined;

  /** Rises after changes, but not more often than people can read. */
  get slow(): ReadonlySignal<number> {
    return this.version;
  }

  /** By the ids of records, or those of the drawing. */
  get(process: string, element: string): ElementState | undefined {
    return this.states.get(keyOf(process, element))?.state;
  }

  *all(): Generator<[process: string, element: string, state: ElementState]> {
    for (const { process, element, state } of this.states.values()) yield [process, element, state];
  }

  listen(listener: Listener): () => void {
    this.listeners.add(listener);
    return () => void this.listeners.delete(listener);
  }

  /** Take what is new; all else stays. */
  merge(elements: Elements): void {
    const changes: ElementChange[] = [];
    for (const [process, states] of Object.entries(elements)) {
      for (const [element, state] of Object.entries(states)) {
        this.set(process, element, state, changes);
      }
    }
    this.tell(changes);
  }

  /** Take all; an element that is missing is as at the start of the run. */
  replace(elements: Elements): void {
    const changes: ElementChange[] = [];
    for (const [process, element] of [...this.all()]) {
      if (!elements[process]?.[element]) this.set(process, element, IDLE, changes);
    }
    for (const [process, states] of Object.entries(elements)) {
      for (const [element, state] of Object.entries(states)) {
        this.set(process, element, state, changes);
      }
    }
    this.tell(changes);
  }

  private set(
    process: string,
    element: string,
    state: ElementState,
    changes: ElementChange[],
  ): void {
    const key = keyOf(process, element);
    const before = this.states.get(key)?.state;
    if (before && same(before, state)) return;
    const kept = { ...state };
    this.states.set(key, { process, element, state: kept });
    changes.push({ process, element, state: kept, before });
  }

  private tell(changes: ElementChange[]): void {
    if (changes.length === 0) return;
    for (const listener of this.listeners) listener(changes);
    this.timer ??= setTimeout(
      () => {
        this.timer = undefined;
        this.version.value += 1;
      },
      Math.max(SLOW_MS, changes.length * EACH_MS),
    );
  }
}

const same = (one: ElementState, other: ElementState): boolean =>
  one.active === other.active &&
  one.hits === other.hits &&
  one.failed === other.failed &&
  one.asking === other.asking &&
  one.last === other.last;
