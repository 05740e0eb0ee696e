// Who has vehicles, payloads and shared space, in words, and which tasks wait for them: read again
// when it has changed, and while a task waits.
import { signal } from "@preact/signals";
import { get } from "../../shared/api";
import { holders, spaceChanges } from "../../shared/executive";
import type { SharedSpace, WaitingTask } from "../../shared/types";

const WAITING_MS = 1000;
const OTHERWISE_MS = 4000;
/** Holders of many vehicles change many times in a second. */
const SOON_MS = 300;

export interface Resources {
  /** The task and run of each behavior and request that has something: "DRIVE of r1". */
  labels: Readonly<Record<string, string>>;
  waiting: readonly WaitingTask[];
  shared_space: readonly SharedSpace[];
}

const NONE: Resources = { labels: {}, waiting: [], shared_space: [] };

export const resources = signal<Resources>(NONE);

/** Keep `resources` up to date until the function that is returned is called. */
export function followResources(): () => void {
  let isOver = false;
  let timer: ReturnType<typeof setTimeout> | undefined;
  let due_ms = Infinity;
  const readIn = (ms: number) => {
    if (isOver || performance.now() + ms >= due_ms) return;
    clearTimeout(timer);
    due_ms = performance.now() + ms;
    timer = setTimeout(() => void read(), ms);
  };
  const read = async () => {
    due_ms = Infinity;
    try {
      const found = document.hidden ? resources.peek() : await get<Resources>("/resources");
      if (!isOver) resources.value = found;
    } catch {
      // The connection says that it is lost.
    }
    readIn(isAwaited(resources.peek()) ? WAITING_MS : OTHERWISE_MS);
  };
  const stops = [holders, spaceChanges].map((source) => source.subscribe(() => readIn(SOON_MS)));
  return () => {
    isOver = true;
    clearTimeout(timer);
    for (const stop of stops) stop();
    resources.value = NONE;
  };
}

const isAwaited = ({ waiting, shared_space }: Resources): boolean =>
  waiting.length > 0 || shared_space.some((space) => space.waiting.length > 0);
