// What colours the states of elements have, and how fast what is over fades. Labels stay dark, and
// are readable on each of them.
import { computed, signal } from "@preact/signals";
import { remember, remembered } from "../../shared/memory";
import type { ElementState } from "../../shared/types";

export type Look = "active" | "asking" | "waiting" | "failed" | "done" | "idle";

export interface Colour {
  fill: [red: number, green: number, blue: number];
  /** Around the shape, so that colours need not be distinguished; dashed where `dash` is set. */
  ring: string;
  dash: number[];
  width: number;
}

export type PaletteName = "green" | "colourBlind";

export type Palette = Record<Exclude<Look, "idle">, Colour>;

const solid = (fill: Colour["fill"], ring: string, width = 3): Colour => ({
  fill,
  ring,
  dash: [],
  width,
});

export const PALETTES: Record<PaletteName, Palette> = {
  green: {
    active: solid([61, 224, 88], "#0a7a26"),
    asking: { ...solid([255, 184, 46], "#8a4b00"), dash: [8, 4] },
    waiting: { ...solid([168, 203, 240], "#1d4f8a"), dash: [3, 3] },
    failed: solid([247, 138, 134], "#a3121a", 4),
    done: solid([218, 222, 225], "", 0),
  },
  // Of Okabe and Ito: everybody can distinguish them.
  colourBlind: {
    active: solid([105, 190, 240], "#00496b"),
    asking: { ...solid([240, 228, 66], "#5a5200"), dash: [8, 4] },
    waiting: { ...solid([224, 170, 200], "#6b2a50"), dash: [3, 3] },
    failed: solid([240, 146, 87], "#7a2d00", 5),
    done: solid([218, 222, 225], "", 0),
  },
};

export const paletteName = signal<PaletteName>(remembered<PaletteName>("palette", "green"));

/** Seconds until what is over is gray; 0: at once. */
export const fade_s = signal<number>(remembered("fade_s", 5));

const still = matchMedia("(prefers-reduced-motion: reduce)").matches;

export const palette = computed(() => PALETTES[paletteName.value]);
export const fading_ms = computed(() => (still ? 0 : fade_s.value * 1000));

export function choosePalette(name: PaletteName): void {
  paletteName.value = name;
  remember("palette", name);
}

export function chooseFade(seconds: number): void {
  fade_s.value = seconds;
  remember("fade_s", seconds);
}

export function lookOf(state: ElementState): Look {
  if (state.stopped) return "failed";
  if (state.asking) return "asking";
  if (state.waiting) return "waiting";
  if (state.active > 0) return "active";
  if (state.failed) return "failed";
  return state.hits > 0 ? "done" : "idle";
}

/** What tells a state without its colour. */
export const SIGNS: Record<Look, string> = {
  asking: "?",
  waiting: "…",
  failed: "✕",
  active: "",
  done: "",
  idle: "",
};

export const css = ([red, green, blue]: Colour["fill"]): string => `rgb(${red} ${green} ${blue})`;
