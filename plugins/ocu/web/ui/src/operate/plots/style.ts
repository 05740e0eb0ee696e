// Lines that can be distinguished: by colour, and by dashes where there are more of them than colours;
// by dashes and widths alone in high contrast, and where the system has its own colours (forced colours).
import { computed, signal } from "@preact/signals";
import { theme } from "../../shared/theme";

export interface Line {
  colour: string;
  dash: number[];
  width: number;
}

/** `--series-1` and so on of the theme. */
export const COLOURS = 8;
const DASHES: readonly number[][] = [[], [8, 4], [2, 3], [12, 3, 2, 3], [5, 2], [2, 6]];

const media = matchMedia("(forced-colors: active)");
const forced = signal(media.matches);
media.addEventListener("change", () => (forced.value = media.matches));

/** What tells lines apart: their colours first, their dashes as well, or their dashes only. */
export type Means = "colours" | "both" | "dashes";

export const means = computed<Means>(() => {
  if (forced.value) return "dashes";
  return theme.value === "contrast" ? "both" : "colours";
});

function strokeOf(index: number, by: Means): { dash: number[]; isWide: boolean } {
  if (by === "colours") {
    return { dash: DASHES[Math.floor(index / COLOURS) % DASHES.length]!, isWide: false };
  }
  const isWide = index % (2 * DASHES.length) >= DASHES.length;
  return { dash: DASHES[index % DASHES.length]!, isWide };
}

/** `host` has the colours of the theme. */
export function lineOf(index: number, host: HTMLElement, by: Means): Line {
  const style = getComputedStyle(host);
  const { dash, isWide } = strokeOf(index, by);
  const series = style.getPropertyValue(`--series-${(index % COLOURS) + 1}`).trim();
  const colour = by === "dashes" ? style.color : series;
  return { colour, dash, width: isWide ? 3 : by === "dashes" ? 1.5 : 1.75 };
}

/** The same as a piece of a line, for legends. */
export function swatchOf(index: number, by: Means) {
  const { dash, isWide } = strokeOf(index, by);
  const colour = by === "dashes" ? "CanvasText" : `var(--series-${(index % COLOURS) + 1})`;
  return { colour, dash: dash.join(" "), width: isWide ? 3 : 2 };
}
