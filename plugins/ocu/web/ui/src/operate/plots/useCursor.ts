// The cursor of plots: the mouse, a finger and the keyboard move it, and drag what is seen.
import type { RefObject } from "preact";
import { useRef } from "preact/hooks";
import { useOperating } from "../context";
import type { TimeWindow } from "../timeline/useTimeWindow";

/** A press that moved less is a click. */
const CLICK_PX = 4;
/** Part of the window that an arrow key moves the cursor by. */
const STEP = 1 / 100;

export function useCursor(
  plot: RefObject<HTMLElement>,
  { window, width, zoom, pan, timeAt }: TimeWindow,
  onSeek: ((t: number) => void) | undefined,
) {
  const { scene, pointed } = useOperating();
  const pressed = useRef<{ from: number; at: number } | null>(null);
  const within = (t: number) =>
    Math.max(window.from_s, Math.min(t, window.from_s + width / window.px_per_s));

  return {
    onPointerDown: (event: PointerEvent) => {
      if (event.button !== 0) return;
      pressed.current = { from: event.clientX, at: event.clientX };
      plot.current?.setPointerCapture(event.pointerId);
      pointed.value = timeAt(event.clientX);
    },
    onPointerMove: (event: PointerEvent) => {
      const press = pressed.current;
      if (press && Math.abs(event.clientX - press.from) > CLICK_PX) {
        pan(press.at - event.clientX);
        press.at = event.clientX;
      }
      pointed.value = timeAt(event.clientX);
    },
    onPointerUp: (event: PointerEvent) => {
      const press = pressed.current;
      pressed.current = null;
      if (press && Math.abs(event.clientX - press.from) <= CLICK_PX) onSeek?.(timeAt(event.clientX));
    },
    onPointerCancel: () => (pressed.current = null),
    onPointerLeave: () => {
      if (!pressed.current && document.activeElement !== plot.current) pointed.value = null;
    },
    onBlur: () => (pointed.value = null),
    onKeyDown: (event: KeyboardEvent) => {
      const t = pointed.value ?? scene.now();
      const step_s = (width / window.px_per_s) * STEP * (event.shiftKey ? 10 : 1);
      const to = {
        ArrowLeft: t - step_s,
        ArrowRight: t + step_s,
        Home: window.from_s,
        End: Infinity,
      }[event.key];
      if (to !== undefined) pointed.value = within(to);
      else if (event.key === "Enter" || event.key === " ") onSeek?.(t);
      else if (event.key === "+") zoom(1.5);
      else if (event.key === "-") zoom(1 / 1.5);
      else if (event.key === "Escape" && !event.shiftKey) pointed.value = null;
      else return;
      event.preventDefault();
    },
  };
}
