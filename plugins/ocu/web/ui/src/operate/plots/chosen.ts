// Which quantities of whom are plotted; the browser remembers it for each fleet.
import { signal, type Signal } from "@preact/signals";
import { remember, remembered } from "../../shared/memory";

export interface Chosen {
  /** null: the first vehicles of the fleet. */
  resources: string[] | null;
  fields: string[];
}

/** More lines than these nobody tells apart without choosing. */
export const FIRST_RESOURCES = 6;
const FIRST_FIELDS = ["battery_percent", "speed_m_s", "altitude_above_home_m", "link"];

export function chosenOf(fleet: string): Signal<Chosen> {
  const otherwise: Chosen = { resources: null, fields: FIRST_FIELDS };
  return signal({ ...otherwise, ...remembered<Partial<Chosen>>(`plots.${fleet}`, {}) });
}

export function choose(chosen: Signal<Chosen>, fleet: string, change: Partial<Chosen>): void {
  chosen.value = { ...chosen.value, ...change };
  remember(`plots.${fleet}`, chosen.value);
}
