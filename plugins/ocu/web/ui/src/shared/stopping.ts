// STOP, until it is delivered: it is sent again and again, and what was not delivered is said.
import { signal } from "@preact/signals";
import { fill, strings } from "../strings";
import { ApiError, post } from "./api";
import { givenNow } from "./command";
import { toast } from "./Toasts";

const text = strings.shell;

const LIMIT_MS = 2000;
const AGAIN_MS = 500;
/** As the server has it. */
const LATE_MS = 5000;
/** The server has understood, and will not do it however often it is sent. */
const FINAL = new Set([400, 401, 403, 404, 422]);

export interface Stop {
  path: string;
  /** What it stops, for people. */
  what: string;
  given_ms: number;
  /** sending: just now. undelivered: and sent again. refused: for good. */
  state: "sending" | "undelivered" | "refused";
  why: string;
}

/** Those that were not delivered yet. */
export const stops = signal<readonly Stop[]>([]);

const find = (path: string) => stops.peek().find((each) => each.path === path);
const without = (path: string) => stops.peek().filter((each) => each.path !== path);

function change(stop: Stop, to: Partial<Stop>): void {
  stops.value = stops.peek().map((each) => (each.path === stop.path ? { ...each, ...to } : each));
}

/** Send it no more; what is on its way may arrive still. */
export function giveUp(path: string): void {
  stops.value = without(path);
}

/** Stop something, and do not rest until that is known. */
export async function stop(path: string, what: string): Promise<void> {
  const going = find(path);
  if (going && going.state !== "refused") return;
  const begun: Stop = { path, what, given_ms: performance.now(), state: "sending", why: "" };
  stops.value = [...without(path), begun];
  const headers = givenNow();
  const goesOn = () => find(path)?.given_ms === begun.given_ms;
  while (goesOn()) {
    try {
      await post(path, { reason: text.stopReason }, { limit_ms: LIMIT_MS, headers });
      return delivered(begun);
    } catch (error) {
      const isFinal = error instanceof ApiError && FINAL.has(error.status);
      const why = error instanceof ApiError ? error.message : "";
      const hasEnded = path !== ALL && error instanceof ApiError && error.status === 409;
      if (hasEnded) return ended(begun, why);
      if (goesOn()) change(begun, { state: isFinal ? "refused" : "undelivered", why });
      if (isFinal) return;
      await new Promise((again) => setTimeout(again, AGAIN_MS));
    }
  }
}

export const ALL = "/stop-all";

function delivered({ path, what, given_ms }: Stop): void {
  giveUp(path);
  const age_ms = performance.now() - given_ms;
  if (age_ms <= LATE_MS) toast(fill(text.stopDelivered, { what }), "good");
  else toast(fill(text.stopLate, { what, age: String(Math.round(age_ms / 1000)) }), "bad");
}

function ended({ path }: Stop, why: string): void {
  giveUp(path);
  toast(why, "bad");
}

// Who leaves the page takes the STOP along that was not delivered.
if (typeof addEventListener === "function") {
  addEventListener("beforeunload", (event: Event) => {
    if (stops.peek().some(({ state }) => state !== "refused")) event.preventDefault();
  });
}
