// Lines that can be told apart: by colour, and by dashes where there are more of them than colours,
// or where the system has its own colours (forced colours).
import { signal } from "@preact/signals";

export interface Line {
  colour: string;
  dash: number[];
  width: number;
}

/** `--series-1` and so on of the theme. */
export const COLOURS = 8;
const DASHES: readonly number[][] = [[], [8, 4], [2, 3], [12, 3, 2, 3], [5, 2], [2, 6]];

const media = matchMedia("(forced-colors: active)");

export const forced = signal(media.matches);
media.addEventListener("change", () => (forced.value = media.matches));

/** `host` has the colours of the theme. */
export function lineOf(index: number, host: HTMLElement, isForced: boolean): Line {
  const style = getComputedStyle(host);
  if (isForced) {
    const width = index % (2 * DASHES.length) < DASHES.length ? 1.5 : 3;
    return { colour: style.color, dash: DASHES[index % DASHES.length]!, width };
  }
  const colour = style.getPropertyValue(`--series-${(index % COLOURS) + 1}`).trim();
  return { colour, dash: DASHES[Math.floor(index / COLOURS) % DASHES.length]!, width: 1.75 };
}

/** The same as a piece of a line, for legends. */
export function swatchOf(index: number, isForced: boolean) {
  const colour = isForced ? "CanvasText" : `var(--series-${(index % COLOURS) + 1})`;
  const at = isForced ? index : Math.floor(index / COLOURS);
  const wide = isForced && index % (2 * DASHES.length) >= DASHES.length;
  return { colour, dash: DASHES[at % DASHES.length]!.join(" "), width: wide ? 3 : 2 };
}
