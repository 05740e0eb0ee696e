// How this browser sounds, shows messages, vibrates and speaks.
import { signal } from "@preact/signals";
import { strings } from "../strings";
import type { Outputs } from "./announcer";
import type { Severity } from "./types";

/** Tones in hertz, one after the other. */
const TONES: Record<Severity, readonly number[]> = {
  critical: [880, 660, 880, 660],
  error: [740, 740],
  warning: [587],
  notice: [],
};
const TONE_S = 0.16;
const GAP_S = 0.06;
const LOUDNESS = 0.25;

const SHAKES: Record<Severity, number[]> = {
  critical: [300, 100, 300, 100, 300],
  error: [200, 100, 200],
  warning: [150],
  notice: [],
};

let audio: AudioContext | null = null;

/** Whether the browser lets this page sound. */
export const maySound = signal(false);

/** Browsers let a page sound only after its user has touched it. */
function audioOf(): AudioContext | null {
  if (!("AudioContext" in window)) return null;
  if (audio === null) {
    audio = new AudioContext();
    audio.onstatechange = () => (maySound.value = audio?.state === "running");
    maySound.value = audio.state === "running";
  }
  if (audio.state === "suspended") void audio.resume().catch(() => undefined);
  return audio;
}

export const outputs: Outputs = {
  sound(severity) {
    const context = audioOf();
    if (!context || context.state !== "running") return;
    TONES[severity].forEach((hertz, place) => {
      const from_s = context.currentTime + place * (TONE_S + GAP_S);
      const tone = context.createOscillator();
      const volume = context.createGain();
      tone.frequency.value = hertz;
      volume.gain.setValueAtTime(LOUDNESS, from_s);
      volume.gain.exponentialRampToValueAtTime(0.001, from_s + TONE_S);
      tone.connect(volume).connect(context.destination);
      tone.start(from_s);
      tone.stop(from_s + TONE_S);
    });
  },
  vibrate(severity) {
    // Refused, with a warning, before the user has touched the page.
    if (navigator.userActivation?.hasBeenActive) navigator.vibrate?.(SHAKES[severity]);
  },
  notify(severity, text) {
    if (!mayNotify()) return;
    const title = `${strings.shell.title}: ${strings.alerts.severity[severity]}`;
    const stays = severity === "critical";
    const shown = new Notification(title, { body: text, tag: "m2pem", requireInteraction: stays });
    shown.onclick = () => window.focus();
  },
  speak(text) {
    if (!("speechSynthesis" in window)) return;
    speechSynthesis.speak(new SpeechSynthesisUtterance(text));
  },
};

export const mayNotify = (): boolean =>
  "Notification" in window && Notification.permission === "granted";

/** Ask the user, who has just clicked, whether messages may be shown. */
export async function askToNotify(): Promise<boolean> {
  if (!("Notification" in window)) return false;
  return (await Notification.requestPermission()) === "granted";
}

/** A click has come: what was waiting for one may sound from now on. */
export function wakeOnTouch(): void {
  const wake = () => void audioOf();
  addEventListener("pointerdown", wake, { once: true });
  addEventListener("keydown", wake, { once: true });
}
