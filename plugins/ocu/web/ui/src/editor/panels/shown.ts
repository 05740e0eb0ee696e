// Which tab of the side panel is shown: panels may lead to each other.
import { signal } from "@preact/signals";

export const FIRST_PANEL = "properties";

export const shownPanel = signal(FIRST_PANEL);

export function showPanel(id: string): void {
  shownPanel.value = id;
}
