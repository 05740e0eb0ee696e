// Whether the list of detections is beside the time line; the browser remembers it.
import { effect, signal } from "@preact/signals";
import { remember, remembered } from "../../shared/memory";

export const detectionsShown = signal(remembered("detections.shown", false));

effect(() => remember("detections.shown", detectionsShown.value));
