// The window of time that the time line and the plots share: the wheel zooms and pans it.
import { useComputed } from "@preact/signals";
import type { RefObject } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import { useOperating } from "../context";
import { rangeOf, whole, windowOf, zoomed, type Window } from "./scale";

export interface TimeWindow {
  window: Window;
  width: number;
  choose: (window: Window | null) => void;
  /** By a factor, around the middle unless it is said where. */
  zoom: (factor: number, around_px?: number) => void;
  pan: (px: number) => void;
  /** The time at a place of the browser's window, in seconds. */
  timeAt: (clientX: number) => number;
}

/** `plot`: what the times are drawn on, from its left edge to its right one. */
export function useTimeWindow(plot: RefObject<HTMLElement>): TimeWindow {
  const { scene, range } = useOperating();
  // In steps, so that everything that shows all of the time shows the same.
  const end_s = useComputed(() => {
    const step_s = scene.mode === "live" ? Math.max(1, scene.pace.value) : 0;
    return step_s ? Math.ceil(scene.end.value / step_s) * step_s : scene.end.value;
  }).value;
  const [width, setWidth] = useState(600);
  const window = range.value ? windowOf(range.value, width) : whole(end_s, width);
  const latest = useRef({ window, width });
  latest.current = { window, width };

  const choose = (to: Window | null) => {
    range.value = to && rangeOf(to, latest.current.width);
  };
  const zoom = (factor: number, around_px = latest.current.width / 2) =>
    choose(zoomed(latest.current.window, factor, around_px));
  const pan = (px: number) => {
    const { from_s, px_per_s } = latest.current.window;
    choose({ px_per_s, from_s: Math.max(0, from_s + px / px_per_s) });
  };
  const timeAt = (clientX: number) => {
    const { from_s, px_per_s } = latest.current.window;
    return from_s + (clientX - plot.current!.getBoundingClientRect().left) / px_per_s;
  };

  useEffect(() => {
    const box = plot.current!;
    const observer = new ResizeObserver(() => setWidth(Math.max(1, box.clientWidth)));
    observer.observe(box);
    const wheel = (event: WheelEvent) => {
      if (event.ctrlKey) {
        event.preventDefault();
        zoom(event.deltaY < 0 ? 1.25 : 0.8, event.clientX - box.getBoundingClientRect().left);
      } else if (event.deltaX !== 0 || event.shiftKey) {
        event.preventDefault();
        pan(event.deltaX || event.deltaY);
      }
    };
    box.addEventListener("wheel", wheel, { passive: false });
    return () => {
      observer.disconnect();
      box.removeEventListener("wheel", wheel);
    };
  }, []);

  return { window, width, choose, zoom, pan, timeAt };
}
