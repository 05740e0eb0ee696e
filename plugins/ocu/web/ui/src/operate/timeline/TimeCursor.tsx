// The time that is pointed at, as a line through all that has the same axis of time.
import { useOperating } from "../context";
import type { Window } from "./scale";

/** A child of what the times are drawn on. */
export function TimeCursor({ window }: { window: Window }) {
  const { pointed } = useOperating();
  const t = pointed.value;
  if (t === null || t < window.from_s) return null;
  return (
    <div
      class="time-cursor"
      style={`left: ${(t - window.from_s) * window.px_per_s}px`}
      aria-hidden="true"
    />
  );
}
