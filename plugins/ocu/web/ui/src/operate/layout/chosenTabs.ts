// Which tabs of the page are chosen, where more than the tabs choose them.
import { signal } from "@preact/signals";

/** The id of the tab with what a run is monitored for. */
export const REQUIREMENTS = "requirements";

/** The id of the tab with breakpoints and data. */
export const DEBUGGING = "debugging";

/** Of the log and what is beside it, where there is room for all. */
export const lowerTab = signal("log");

/** Of all but the diagram, where there is no room. */
export const narrowTab = signal("map");

export const showRequirements = (): void => show(REQUIREMENTS);

export const showDebugging = (): void => show(DEBUGGING);

function show(tab: string): void {
  lowerTab.value = tab;
  narrowTab.value = tab;
}
