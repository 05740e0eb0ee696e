// Light, dark or of high contrast: as the system has it, until the user chooses.
import { computed, effect, signal } from "@preact/signals";
import { remember, remembered } from "./memory";

export const THEMES = ["light", "dark", "contrast"] as const;
export type Theme = (typeof THEMES)[number];

const isTheme = (name: unknown): name is Theme => THEMES.includes(name as Theme);

const wantsDark = matchMedia("(prefers-color-scheme: dark)");
const wantsContrast = matchMedia("(prefers-contrast: more)");

const ofSystem = (): Theme =>
  wantsContrast.matches ? "contrast" : wantsDark.matches ? "dark" : "light";

const system = signal(ofSystem());
for (const each of [wantsDark, wantsContrast]) {
  each.addEventListener("change", () => (system.value = ofSystem()));
}

const before = remembered<unknown>("theme", null);

/** null: as the system has it. */
export const chosenTheme = signal<Theme | null>(isTheme(before) ? before : null);

export const theme = computed<Theme>(() => chosenTheme.value ?? system.value);

effect(() => {
  const { dataset } = document.documentElement;
  // The theme of high contrast is a dark one, with other colours in some places.
  dataset.theme = theme.value === "light" ? "light" : "dark";
  dataset.contrast = theme.value === "contrast" ? "more" : "usual";
});

export function chooseTheme(chosen: Theme | null): void {
  chosenTheme.value = chosen;
  remember("theme", chosen);
}
