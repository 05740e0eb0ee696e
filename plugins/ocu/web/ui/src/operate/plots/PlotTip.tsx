// The values where the mouse is, beside it.
import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { clockTenths } from "../../shared/format";
import { useOperating } from "../context";
import type { Window } from "../timeline/scale";
import type { TelemetryHistory } from "./history";
import { nameOf } from "./names";
import { Swatch } from "./Swatch";
import { readValue } from "./values";

const MOST_LINES = 8;
const BESIDE_PX = 12;

export interface TipProps {
  history: TelemetryHistory;
  fields: readonly string[];
  resources: readonly string[];
  window: Window;
  width: number;
  /** Where the first chart begins, and how high each is. */
  top_px: number;
  chart_px: number;
}

/** A child of what is pointed at. The table has the same for all quantities. */
export function PlotTip({ history, fields, resources, window, width, top_px, chart_px }: TipProps) {
  const { pointed } = useOperating();
  const over_px = useSignal<number | null>(null);
  const mark = useRef<HTMLDivElement>(null);
  useEffect(() => {
    const box = mark.current!.parentElement!;
    const move = (event: PointerEvent) => {
      over_px.value = event.clientY - box.getBoundingClientRect().top;
    };
    const leave = () => (over_px.value = null);
    box.addEventListener("pointermove", move);
    box.addEventListener("pointerleave", leave);
    return () => {
      box.removeEventListener("pointermove", move);
      box.removeEventListener("pointerleave", leave);
    };
  }, []);

  const t = pointed.value;
  const at = over_px.value === null ? -1 : Math.floor((over_px.value - top_px) / chart_px);
  const field = fields[at];
  const known = field
    ? resources
        .map((resource, index) => ({ resource, index }))
        .filter(({ resource }) => history.series(resource, field))
    : [];
  const x = t === null ? 0 : (t - window.from_s) * window.px_per_s;
  const side =
    x > width / 2 ? `right: ${width - x + BESIDE_PX}px` : `left: ${x + BESIDE_PX}px`;
  return (
    <div ref={mark} aria-hidden="true">
      {t !== null && field && known.length > 0 && (
        <div class="plot-tip" style={`${side}; top: ${top_px + at * chart_px + 4}px`}>
          <b>
            {nameOf(field)} · {clockTenths(t)}
          </b>
          {known.slice(0, MOST_LINES).map(({ resource, index }) => (
            <p key={resource}>
              <Swatch index={index} /> {resource} <span>{readValue(history, resource, field, t)}</span>
            </p>
          ))}
          {known.length > MOST_LINES && <p>…</p>}
        </div>
      )}
    </div>
  );
}
