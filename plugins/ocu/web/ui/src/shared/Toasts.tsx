// Short messages that come and go by themselves; refusals stay until they are dismissed.
import { signal } from "@preact/signals";
import { counted, strings } from "../strings";
import { ApiError } from "./api";
import { newest, type Tone } from "./newestToasts";
import "./toasts.css";
import { textScale } from "./textScale";
import { atScale } from "./useMedia";

export interface Toast {
  id: number;
  text: string;
  tone: Tone;
  at_ms: number;
}

const SHOWN_MS = 6000;
/** Of faults, which the alerts and the log of their run keep: what is below is needed then. */
const FAULT_SHOWN_MS = 20_000;
/** A phone that lies has less room: what is below, such as a question, stays in view. */
const LOW = "(height < 480px)";
const most = (): number => (matchMedia(atScale(LOW, textScale.value)).matches ? 1 : 3);
const MOST_EARLIER = 100;

const toasts = signal<Toast[]>([]);
/** Those that had to make room, the newest first: the list of alerts has them. */
export const earlier = signal<readonly Toast[]>([]);
let count = 0;

export function toast(text: string, tone: Tone = "plain"): void {
  const id = ++count;
  const all = [...toasts.value, { id, text, tone, at_ms: Date.now() }];
  toasts.value = newest(all, most());
  const left = all.filter((each) => !toasts.peek().includes(each)).reverse();
  if (left.length > 0) earlier.value = [...left, ...earlier.peek()].slice(0, MOST_EARLIER);
  if (tone !== "bad") setTimeout(() => dismiss(id), SHOWN_MS);
}

/** Something went wrong that is no answer to what was done here. */
export function toastFault(text: string): void {
  toast(`${strings.shell.fault}: ${text}`, "bad");
  const id = count;
  setTimeout(() => dismiss(id), FAULT_SHOWN_MS);
}

/** Do what may be refused, and say so if it was. */
export async function attempt(action: () => Promise<unknown>): Promise<boolean> {
  try {
    await action();
    return true;
  } catch (error) {
    toast(error instanceof ApiError ? error.message : strings.shell.offline, "bad");
    return false;
  }
}

function dismiss(id: number): void {
  toasts.value = toasts.value.filter((other) => other.id !== id);
}

export function Toasts() {
  const count = earlier.value.length;
  const shown = (tone: "bad" | "other") =>
    toasts.value.filter((each) => (each.tone === "bad") === (tone === "bad"));
  return (
    <div class="toasts">
      <div role="alert">{shown("bad").map(line)}</div>
      <div role="status">
        {shown("other").map(line)}
        {count > 0 && toasts.value.length > 0 && (
          <p class="toast-more">{counted(strings.shell.earlierMessages, count)}</p>
        )}
      </div>
    </div>
  );
}

function line({ id, text, tone }: Toast) {
  return (
    <div key={id} class={`toast toast-${tone}`}>
      <span>{text}</span>
      <button type="button" aria-label={strings.shell.dismiss} onClick={() => dismiss(id)}>
        ×
      </button>
    </div>
  );
}
