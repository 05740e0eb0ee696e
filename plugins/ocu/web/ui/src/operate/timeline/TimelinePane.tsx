// Who did what when: a row for each vehicle and payload, questions and services above.
import type { Signal } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";
import { PROMPTS, SERVICES, WAITS, type Bars as Shown, type Span } from "../../records/spans";
import { clock } from "../../shared/format";
import { fill, strings } from "../../strings";
import type { Fleet } from "../../shared/types";
import { useOperating } from "../context";
import { detectionsShown } from "../detections/shown";
import { Pane } from "../layout/Pane";
import { usePaced } from "../layout/pace";
import type { Scene } from "../scene/scene";
import { resources } from "../vehicles/resources";
import { heldElsewhere, waitersOf } from "../vehicles/work";
import { Bars } from "./Bars";
import { lanes, marks, type Bar } from "./scale";
import { TimeCursor } from "./TimeCursor";
import { TimeTools } from "./TimeTools";
import { useTimeWindow } from "./useTimeWindow";
import "./timeline.css";
import { textScale } from "../../shared/textScale";

const text = strings.operate.timeline;

/** At the usual text size. */
const LANE_PX = 22;
const AXIS_PX = 22;
/** Bars that go on grow slowly; who replays looks closer. What begins or ends is drawn at once. */
const EVERY_MS: Record<Scene["mode"], number> = { live: 1000, replay: 200 };
/** Between a bar and who has the vehicle since. */
const HELD_PX = 6;

export interface Row {
  id: string;
  title: string;
  top: number;
  height: number;
  bars: Bar<Span>[];
}

export interface TimelineProps {
  onSeek?: ((t: number) => void) | undefined;
  /** Whether there are plots below, where there is room for both. */
  plots?: Signal<boolean>;
}

export function TimelinePane({ onSeek, plots }: TimelineProps) {
  const { scene, fleet, pointed, range } = useOperating();
  const { spans } = usePaced(scene.timeline, 300);
  usePaced(scene.time, EVERY_MS[scene.mode]);
  const time = scene.now();
  const plot = useRef<HTMLDivElement>(null);
  const scale = textScale.value;
  const [lane_px, axis_px] = [LANE_PX * scale, AXIS_PX * scale];
  const rows = useMemo(
    () => rowsOf(spans, fleet, lane_px),
    [spans, spans.all.length, fleet, lane_px],
  );
  const goesOn = useMemo(() => spans.all.some(({ to }) => to === null), [spans, time]);
  const height = (rows.at(-1)?.top ?? 0) + (rows.at(-1)?.height ?? 0);
  const shown = useTimeWindow(plot);
  const { window, width } = shown;
  useEffect(() => scene.lookAt(range.value), [scene, range.value]);
  // Of a long run there are many: they are drawn again only where one changes.
  const bars = useMemo(
    () => (
      <Bars
        rows={rows}
        window={window}
        width={width}
        now={time}
        lane_px={lane_px}
        onSeek={onSeek}
      />
    ),
    [rows, window.from_s, window.px_per_s, width, goesOn ? time : 0, scene],
  );
  const x = (t: number) => (t - window.from_s) * window.px_per_s;
  return (
    <Pane
      title={strings.operate.panes.timeline}
      class="timeline-pane"
      scrolls
      tools={
        <TimeTools shown={shown}>
          {plots && <DetectionsButton />}
          {plots && (
            <button
              type="button"
              class="plain"
              aria-pressed={plots.value}
              onClick={() => (plots.value = !plots.value)}
            >
              {strings.operate.panes.plots}
            </button>
          )}
        </TimeTools>
      }
    >
      <div class="timeline" title={text.hint}>
        <ul class="timeline-rows" style={`padding-top: ${axis_px}px`} aria-hidden="true">
          {rows.map((row) => (
            <li key={row.id} style={`height: ${row.height}px`}>
              {row.title}
            </li>
          ))}
        </ul>
        <div
          ref={plot}
          class={onSeek ? "timeline-plot timeline-seek" : "timeline-plot"}
          onMouseMove={(event) => (pointed.value = shown.timeAt(event.clientX))}
          onMouseLeave={() => (pointed.value = null)}
        >
          <svg
            width={width}
            height={Math.max(height + axis_px, 60)}
            role="group"
            aria-label={text.label}
            onClick={(event) => onSeek?.(shown.timeAt(event.clientX))}
          >
            {marks(window, width, 70 * scale).map((t) => (
              <g
                key={t}
                class={x(t) < 20 * scale ? "mark mark-first" : "mark"}
                transform={`translate(${x(t)} 0)`}
              >
                <line y1={axis_px} y2="100%" />
                <text y={14 * scale}>{clock(t)}</text>
              </g>
            ))}
            <g transform={`translate(0 ${axis_px})`}>
              {rows.map((row) => (
                <line key={row.id} class="row-line" x2="100%" y1={row.top} y2={row.top} />
              ))}
              {scene.mode === "live" &&
                rows.map((row) => (
                  <Held
                    key={row.id}
                    row={row}
                    held={elsewhere(row.id, scene)}
                    x={Math.max(0, x(lastOf(row))) + HELD_PX}
                  />
                ))}
              {bars}
            </g>
            <line class="now" x1={x(time)} x2={x(time)} y1={axis_px - 6} y2="100%" />
          </svg>
          <TimeCursor window={window} />
          {spans.all.length === 0 && <p class="nothing">{text.none}</p>}
        </div>
      </div>
    </Pane>
  );
}

/** Shows the list of detections, if there are any. */
function DetectionsButton() {
  const { scene } = useOperating();
  const { all, more } = scene.detections.value;
  if (all.length + more === 0) return null;
  return (
    <button
      type="button"
      class="plain"
      aria-pressed={detectionsShown.value}
      onClick={() => (detectionsShown.value = !detectionsShown.value)}
    >
      {fill(strings.operate.detections.title, { count: all.length + more })}
    </button>
  );
}

/** Who else has a vehicle or payload, and what waits for it, in words. */
function elsewhere(resource: string, { holders, run }: Scene): string {
  const { labels, waiting } = resources.value;
  const held = heldElsewhere(resource, holders.value[resource] ?? "", run, labels);
  return [held, held && waitersOf(resource, waiting)].filter(Boolean).join("; ");
}

/** Who else has the vehicle of a row, while this run does nothing with it. */
function Held({ row, held, x }: { row: Row; held: string; x: number }) {
  if (!held || row.bars.some(({ span }) => span.to === null)) return null;
  return (
    <g class="held" role="img" aria-label={`${row.title}: ${held}`}>
      <text x={x} y={row.top + 17 * textScale.value}>
        {held}
      </text>
    </g>
  );
}

const lastOf = (row: Row): number => Math.max(0, ...row.bars.map(({ span }) => span.to ?? 0));

function rowsOf(spans: Shown, fleet: Fleet, lane_px: number): Row[] {
  const inRow = new Map<string, Span[]>();
  for (const span of spans.all) {
    const row = inRow.get(span.row);
    if (row) row.push(span);
    else inRow.set(span.row, [span]);
  }
  const resources = fleet.vehicles.flatMap(({ id }) => [
    id,
    ...fleet.payloads.filter(({ vehicle }) => vehicle === id).map((payload) => payload.id),
  ]);
  const named = new Set([...fleet.vehicles.map(({ id }) => id), ...spans.rows]);
  const order = [...new Set([PROMPTS, WAITS, SERVICES, ...resources, ...spans.rows, ...inRow.keys()])];
  let top = 0;
  return order
    .filter((id) => inRow.has(id) || named.has(id))
    .map((id) => {
      const bars = lanes(inRow.get(id) ?? []);
      const height = Math.max(1, ...bars.map(({ lane }) => lane + 1)) * lane_px + 4;
      const row = { id, title: titleOf(id), top, height, bars };
      top += height;
      return row;
    });
}

function titleOf(id: string): string {
  if (id === PROMPTS) return text.prompts;
  if (id === WAITS) return text.waits;
  return id === SERVICES ? text.services : id;
}
