// The menu at an element of a run, while it is open, and the key that does the same.
import { signal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { useOperating, type Place } from "../context";
import { isTyping } from "../layout/keys";
import { mayHaveOne, refusalOf, turn, type Shown } from "./setting";

/** `x`, `y`: in pixels, from the corner of the window. */
export const elementMenu = signal<(Place & { x: number; y: number }) | null>(null);

/** Open it, where the run goes on. */
export function openMenu(shown: Shown, place: Place, x: number, y: number): void {
  if (refusalOf(shown) !== null) elementMenu.value = { ...place, x, y };
}

export const BREAKPOINT_KEY = "b";

/** Whether a key sets a breakpoint. */
export const isBreakpointKey = (event: KeyboardEvent): boolean =>
  event.key.toLowerCase() === BREAKPOINT_KEY &&
  !(event.ctrlKey || event.altKey || event.metaKey || event.repeat);

/** The key acts on the element that is selected. */
export function useBreakpointKey(): void {
  const shown = useOperating();
  useEffect(() => {
    const press = (event: KeyboardEvent) => {
      const place = shown.selected.peek();
      if (!place || !isBreakpointKey(event) || !mayHaveOne(shown.mission, place)) return;
      if (isTyping(document.activeElement) || document.getElementById("main")?.inert) return;
      event.preventDefault();
      turn(shown, place.element);
    };
    addEventListener("keydown", press);
    return () => removeEventListener("keydown", press);
  }, [shown]);
}
