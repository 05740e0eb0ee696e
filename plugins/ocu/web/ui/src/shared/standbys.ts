// The executives that stand by for this one. When it has died, the page goes on at the one of them
// that serves by then; on the same host and port the connection is made again, without that.
import { effect, signal } from "@preact/signals";
import { get } from "./api";
import { connection } from "./executive";
import { route } from "./router";
import type { Standby } from "./types";

/** Known from the last time that this page was connected. */
export const standbys = signal<Standby[]>([]);

const LOOK_MS = 2000;

let looking = false;

/** Look again and again, and as soon as this page is connected. */
export function followStandbys(): void {
  effect(() => {
    if (connection.value === "open") void lookForStandbys();
  });
  setInterval(() => void lookForStandbys(), LOOK_MS);
}

/** Ask who stands by; or, when the executive is lost, whether one of them serves. */
async function lookForStandbys(): Promise<void> {
  if (looking) return;
  looking = true;
  try {
    if (connection.value === "open") standbys.value = await get<Standby[]>("/standbys");
    else if (connection.value === "lost") await goOn();
  } catch {
    // It does not answer: the connection tells so.
  } finally {
    looking = false;
  }
}

async function goOn(): Promise<void> {
  for (const { page } of standbys.value) {
    if (!page || new URL(page).origin === location.origin || !(await serves(page))) continue;
    // What an editor has not saved stays here, until who draws goes on.
    if (connection.value !== "lost" || route.value.page === "editor") return;
    location.assign(new URL(location.pathname + location.search, page));
    return;
  }
}

async function serves(page: string): Promise<boolean> {
  try {
    const limit = { cache: "no-store", credentials: "omit" } as const;
    const signal = AbortSignal.timeout(LOOK_MS);
    return (await fetch(new URL("readyz", page), { ...limit, signal })).ok;
  } catch {
    return false;
  }
}
