// Short messages that come and go by themselves; refusals stay until they are dismissed.
import { signal } from "@preact/signals";
import { strings } from "../strings";
import { ApiError } from "./api";
import { newest, type Tone } from "./newestToasts";
import "./toasts.css";
import { textScale } from "./textScale";
import { atScale } from "./useMedia";

interface Toast {
  id: number;
  text: string;
  tone: Tone;
}

const SHOWN_MS = 6000;
/** Of faults, which the alerts and the log of their run keep: what is below is needed then. */
const FAULT_SHOWN_MS = 20_000;
/** A phone has less room: what is below, such as a question, stays in view. */
const SMALL = "(width < 600px)";
const LOW = "(height < 480px)";
const isSo = (query: string): boolean => matchMedia(atScale(query, textScale.value)).matches;
const most = (): number => (isSo(LOW) ? 1 : isSo(SMALL) ? 3 : 5);

const toasts = signal<Toast[]>([]);
let count = 0;

export function toast(text: string, tone: Tone = "plain"): void {
  const id = ++count;
  toasts.value = newest([...toasts.value, { id, text, tone }], most());
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
  const shown = (tone: "bad" | "other") =>
    toasts.value.filter((each) => (each.tone === "bad") === (tone === "bad"));
  return (
    <div class="toasts">
      <div role="alert">{shown("bad").map(line)}</div>
      <div role="status">{shown("other").map(line)}</div>
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
