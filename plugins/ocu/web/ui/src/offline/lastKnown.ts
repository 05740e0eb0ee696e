// What this browser saw last of its executive, for when it cannot reach it: written every few seconds
// while it is connected, and forgotten when the user signs out.
import { effect } from "@preact/signals";
import { connection, runs } from "../shared/executive";
import { remember, remembered } from "../shared/memory";
import { titleOf } from "../shared/runs";
import { session } from "../shared/session";

const EVERY_MS = 5000;

export interface LastKnown {
  fleet: string;
  simulated: boolean;
  runs: { run: string; title: string; status: string }[];
  /** Since the Unix epoch. */
  at_ms: number;
}

export const lastKnown = (): LastKnown | null => remembered<LastKnown | null>("last-known", null);

function note(): void {
  const now = session.peek();
  if (!now || connection.peek() !== "open") return;
  const { fleet, simulated } = now;
  const going = runs
    .peek()
    .filter(({ status }) => status === "running" || status === "paused")
    .map((each) => ({ run: each.run, title: titleOf(each), status: each.status }));
  remember("last-known", { fleet, simulated, runs: going, at_ms: Date.now() } satisfies LastKnown);
}

export function followLastKnown(): void {
  effect(() => {
    if (session.value === null) remember("last-known", null);
  });
  effect(() => {
    if (connection.value === "open" && runs.value) note();
  });
  setInterval(note, EVERY_MS);
}
