// Light or dark: as the system has it, until the user chooses.
import { effect, signal } from "@preact/signals";
import { remembered, remember } from "./memory";

export type Theme = "light" | "dark";

const system = (): Theme => (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");

export const theme = signal<Theme>(remembered<Theme | null>("theme", null) ?? system());

effect(() => {
  document.documentElement.dataset.theme = theme.value;
});

export function switchTheme(): void {
  theme.value = theme.value === "dark" ? "light" : "dark";
  remember("theme", theme.value);
}
