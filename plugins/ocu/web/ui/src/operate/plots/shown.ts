// Whether there are plots below the time line; the browser remembers it.
import { effect, signal } from "@preact/signals";
import { remember, remembered } from "../../shared/memory";

export const plotsShown = signal(remembered("plots.shown", false));

effect(() => remember("plots.shown", plotsShown.value));
