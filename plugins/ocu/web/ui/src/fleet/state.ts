// What all parts of the page of the fleet look at together.
import { batch, signal } from "@preact/signals";
import { get } from "../shared/api";
import { connection, holders, runs } from "../shared/executive";
import { remember, remembered } from "../shared/memory";
import type { Filter, Grouping, ResourceStatus, Sorting } from "./rows";

export const status = signal<Record<string, ResourceStatus>>({});
/** The vehicle or payload whose details are shown; "": none. */
export const focused = signal("");
/** Those that a command goes to, in place of the focused one. */
export const selected = signal<ReadonlySet<string>>(new Set());
/** A vehicle to bring into view on the map; a new object each time. */
export const centred = signal<{ resource: string } | null>(null);

export const search = signal("");
export const filters = signal<ReadonlySet<Filter>>(new Set());
export const grouping = signal(remembered<Grouping>("fleet.group", "none"));
export const sorting = signal(
  remembered<Sorting>("fleet.sort", { column: "name", descending: false }),
);
export const withPayloads = signal(remembered("fleet.payloads", false));

/** A position that is picked on the map, as the text of a parameter. */
export interface Picking {
  behavior: string;
  parameter: string;
  picked: (latitude: number, longitude: number) => void;
}
export const picking = signal<Picking | null>(null);
/** The picked position, where the command's targets will go: [latitude, longitude]. */
export const destination = signal<[number, number] | null>(null);
/** The middle of the map, while there is one. */
export const middle = { current: (): [number, number] | null => null };

grouping.subscribe((now) => remember("fleet.group", now));
sorting.subscribe((now) => remember("fleet.sort", now));
withPayloads.subscribe((now) => remember("fleet.payloads", now));

/** Whom a command goes to. */
export function targets(): string[] {
  if (selected.value.size > 0) return [...selected.value];
  return focused.value ? [focused.value] : [];
}

export function select(resources: Iterable<string>, isSelected: boolean): void {
  const next = new Set(selected.peek());
  for (const resource of resources) {
    if (isSelected) next.add(resource);
    else next.delete(resource);
  }
  selected.value = next;
}

/** What the fleet does not have any more, after a restart, can be neither shown nor commanded. */
export function keepKnown(resources: ReadonlySet<string>): void {
  batch(() => {
    if (!resources.has(focused.peek())) focused.value = "";
    const kept = [...selected.peek()].filter((each) => resources.has(each));
    if (kept.length !== selected.peek().size) selected.value = new Set(kept);
  });
}

const SOON_MS = 300;
const EVERY_MS = 5000;

/** Keep `status` up to date until the function that is returned is called. */
export function followStatus(): () => void {
  let isOver = false;
  let timer: ReturnType<typeof setTimeout> | undefined;
  const read = async () => {
    timer = undefined;
    try {
      const found = await get<{ resources: Record<string, ResourceStatus> }>("/fleet/status");
      if (!isOver) status.value = found.resources;
    } catch {
      // The connection says that it is lost; it is asked again when that is back.
    }
  };
  const soon = () => {
    timer ??= setTimeout(() => void read(), SOON_MS);
  };
  const stops = [holders, runs, connection].map((source) => source.subscribe(soon));
  const every = setInterval(() => {
    if (!document.hidden && connection.peek() === "open") soon();
  }, EVERY_MS);
  return () => {
    isOver = true;
    clearTimeout(timer);
    clearInterval(every);
    for (const stop of stops) stop();
  };
}

/** Ask for the status at once: a command was given. */
export async function readStatus(): Promise<void> {
  try {
    const found = await get<{ resources: Record<string, ResourceStatus> }>("/fleet/status");
    status.value = found.resources;
  } catch {
    // As above.
  }
}
