// Which runs are asked for, as the table of runs is filtered, sorted and turned over.
import type { RunStatus } from "../shared/types";

export type SortedBy = "active" | "began" | "mission" | "status" | "took";

export interface RunQuery {
  status: string;
  text: string;
  vehicle: string;
  /** Seconds back from now; 0: all. */
  within_s: number;
  sort: SortedBy;
  descending: boolean;
  page: number;
}

export const ALL_RUNS: RunQuery = {
  status: "",
  text: "",
  vehicle: "",
  within_s: 0,
  sort: "active",
  descending: true,
  page: 0,
};

export const PAGE = 25;

/** Statuses that are chosen together. */
export const GROUPS: Record<string, readonly RunStatus[]> = {
  goingOn: ["running", "paused"],
  ended: ["completed", "terminated", "failed", "stopped", "interrupted"],
};

/** The path of a page. `now_ms`: since the Unix epoch. */
export function pathOf(query: RunQuery, now_ms: number): string {
  const said = new URLSearchParams();
  for (const each of GROUPS[query.status] ?? (query.status ? [query.status] : []))
    said.append("status", each);
  if (query.text.trim()) said.set("text", query.text.trim());
  if (query.vehicle) said.set("vehicle", query.vehicle);
  // To the minute: the same page has the same address for a while.
  if (query.within_s > 0)
    said.set("since_us", String((Math.floor(now_ms / 60_000) * 60 - query.within_s) * 1_000_000));
  said.set("sort", query.sort);
  said.set("descending", String(query.descending));
  said.set("offset", String(query.page * PAGE));
  said.set("limit", String(PAGE));
  return `/run-pages?${said}`;
}

/** A click on a column's head: sort by it, or the other way. */
export function sortedBy(query: RunQuery, sort: SortedBy): RunQuery {
  const descending = query.sort === sort ? !query.descending : sort !== "mission";
  return { ...query, sort, descending, page: 0 };
}

export type Deed = "pause" | "resume" | "stop";

/** What can be done with a run. */
export function mayDo(deed: Deed, status: RunStatus): boolean {
  if (deed === "pause") return status === "running";
  if (deed === "resume") return status === "paused";
  return status === "running" || status === "paused" || status === "interrupted";
}
