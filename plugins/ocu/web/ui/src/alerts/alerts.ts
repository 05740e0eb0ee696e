// The alerts of the executive, as every page shows them, and what operators do about them.
import { computed, effect, signal } from "@preact/signals";
import { get } from "../shared/api";
import { command } from "../shared/command";
import { alertChanges, speed } from "../shared/executive";
import { remember, remembered } from "../shared/memory";
import { session } from "../shared/session";
import { fill, strings } from "../strings";
import { Announcer, DEFAULTS, type AlertSettings } from "./announcer";
import { outputs, wakeOnTouch } from "./outputs";
import { isAtLeast, type OperatorAlert } from "./types";

const AGAIN_MS = 5000;

export const alerts = signal<readonly OperatorAlert[]>([]);
export const failed = signal(false);

/** Those that nobody has acknowledged. */
export const calling = computed(() => alerts.value.filter(({ calls }) => calls));

/** Whether one of them is so severe that it must be seen at once. */
export const isSevere = computed(() =>
  calling.value.some(({ severity }) => isAtLeast(severity, "error")),
);

/** When the alerts were read, by this page's clock: ages and deadlines go on from there. */
let readAt_ms = 0;

/** Seconds that have passed since then, by the executive's clock. */
export const passed_s = (): number => ((performance.now() - readAt_ms) / 1000) * speed.value;

/** Rises every second while the page is looked at, so that ages go on. */
export const ticks = signal(0);

/** Seconds until the next question is withdrawn; null: no question has a deadline. */
export const nextDeadline_s = computed(() => {
  void ticks.value;
  const left = calling.value.flatMap(({ left_s }) => (left_s === null ? [] : [left_s]));
  return left.length > 0 ? Math.max(0, Math.min(...left) - passed_s()) : null;
});

/** Seconds until a question is withdrawn; null: it has no deadline. */
export function leftOf_s(run: string, prompt: string): number | null {
  void ticks.value;
  const found = alerts.value.find((each) => each.run === run && each.subject === prompt);
  const left_s = found?.left_s ?? null;
  return left_s === null ? null : Math.max(0, left_s - passed_s());
}

export const settings = signal<AlertSettings>({ ...DEFAULTS, ...remembered("alerts", {}) });

export function change(changed: Partial<AlertSettings>): void {
  settings.value = { ...settings.value, ...changed };
  remember("alerts", settings.value);
}

const several = (count: number, text: string) => fill(strings.alerts.several, { count, text });

export const announcer = new Announcer(
  outputs,
  () => (speaks ? settings.value : { sound: "off", notify: false, vibrate: false, speech: false }),
  several,
);

let reading = false;
let stale = false;

/** Read the list; what changes meanwhile is read once more, and not once for each change. */
async function read(): Promise<void> {
  if (reading) {
    stale = true;
    return;
  }
  reading = true;
  do {
    stale = false;
    try {
      const found = await get<OperatorAlert[]>("/alerts");
      readAt_ms = performance.now();
      alerts.value = found;
      failed.value = false;
      announcer.announce(found);
    } catch {
      failed.value = true;
    }
  } while (stale);
  reading = false;
}

/** Of several pages of this browser, one tells what is new: the first that is open. */
let speaks = !("locks" in navigator);

export function followAlerts(): void {
  wakeOnTouch();
  if (!speaks) {
    void navigator.locks.request("m2pem-alerts", () => {
      speaks = true;
      return new Promise(() => undefined);
    });
  }
  effect(() => {
    if (alertChanges.value > 0 && session.value) void read();
  });
  setInterval(() => {
    if (!document.hidden && alerts.value.length > 0) ticks.value += 1;
  }, 1000);
  setInterval(() => announcer.again(), AGAIN_MS);
}

const pathOf = (alert: string) => `/alerts/${encodeURIComponent(alert)}`;

export const acknowledge = (alert: string): Promise<boolean> =>
  command(`${pathOf(alert)}/acknowledge`);

/** Take care of an alert, or (`gives`) no more. */
export const own = (alert: string, gives = false): Promise<boolean> =>
  command(`${pathOf(alert)}/own`, gives ? { owner: "" } : {});

export async function acknowledgeAll(which: readonly OperatorAlert[]): Promise<void> {
  for (const { alert } of which) await acknowledge(alert);
}

/** `1:05`, or `2:03:04`. */
export function span(seconds: number): string {
  const whole = Math.max(0, Math.round(seconds));
  const parts = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  const [hours = 0, minutes = 0, rest = 0] = parts;
  const two = (part: number) => String(part).padStart(2, "0");
  return hours > 0 ? `${hours}:${two(minutes)}:${two(rest)}` : `${minutes}:${two(rest)}`;
}
