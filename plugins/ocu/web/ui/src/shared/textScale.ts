// How much larger than usual the texts are: by the user's choice, the browser's, and the screen's.
// What is counted in px by the page's programs is multiplied by it, as style sheets are.
import { signal } from "@preact/signals";

const USUAL_PX = 16;

const measured = (): number =>
  typeof document === "undefined"
    ? 1
    : parseFloat(getComputedStyle(document.documentElement).fontSize) / USUAL_PX || 1;

/** 1: as usual. */
export const textScale = signal(measured());

/** Measure it, after a change of the settings or the window. */
export function measureTextScale(): void {
  textScale.value = measured();
}

if (typeof addEventListener === "function") addEventListener("resize", measureTextScale);
