// What the user has chosen for this browser: colours, text size, size of the controls. The language
// is in strings/language.ts, since texts come first.
import { effect, signal } from "@preact/signals";
import { remember, remembered } from "./memory";
import { measureTextScale } from "./textScale";

/** In percent. */
export const TEXT_SIZES = [100, 125, 150, 200] as const;
export type TextSize = (typeof TEXT_SIZES)[number];

/** large: for gloves; a finger finds what is 48 px wide and high. */
export const CONTROLS = ["usual", "large"] as const;
export type Controls = (typeof CONTROLS)[number];

const oneOf = <T,>(known: readonly T[], name: string, usual: T): T => {
  const found = remembered<T>(name, usual);
  return known.includes(found) ? found : usual;
};

export const textSize = signal<TextSize>(oneOf(TEXT_SIZES, "text-size", 100));
export const controls = signal<Controls>(oneOf(CONTROLS, "controls", "usual"));

export function chooseTextSize(size: TextSize): void {
  textSize.value = size;
  remember("text-size", size);
}

export function chooseControls(size: Controls): void {
  controls.value = size;
  remember("controls", size);
}

effect(() => {
  document.documentElement.style.setProperty("--text-size", String(textSize.value / 100));
  document.documentElement.dataset.controls = controls.value;
  measureTextScale();
});
