// Plots of telemetry over the time of the run, with the time line's axis and cursor.
import { useMemo, useRef } from "preact/hooks";
import { clock } from "../../shared/format";
import { fill, strings } from "../../strings";
import { useOperating } from "../context";
import { useMedia } from "../../shared/useMedia";
import { usePaced } from "../layout/pace";
import { Pane } from "../layout/Pane";
import { marks, rangeOf } from "../timeline/scale";
import { TimeCursor } from "../timeline/TimeCursor";
import { TimeTools } from "../timeline/TimeTools";
import { useTimeWindow } from "../timeline/useTimeWindow";
import { Chart } from "./Chart";
import { choose, chosenOf, FIRST_RESOURCES } from "./chosen";
import { Chooser } from "./Chooser";
import { csvOf } from "./csv";
import { titleOf } from "./names";
import { PlotTip } from "./PlotTip";
import { useCursor } from "./useCursor";
import { ValuesTable } from "./ValuesTable";
import "./plots.css";
import { textScale } from "../../shared/textScale";

const text = strings.plots;

const EVERY_MS = { live: 1000, replay: 200 } as const;
/** All at the usual text size. The values' axis is as wide as the names of the rows of the time line, but on a phone. */
const AXIS_PX = 96;
const NARROW_AXIS_PX = 52;
const NARROW = "(width < 600px)";
const CHART_PX = 118;
/** Of it, with the border above. */
const TITLE_PX = 19;
const MARKS_PX = 22;

export default function PlotsPane({ onSeek }: { onSeek?: ((t: number) => void) | undefined }) {
  const { scene, fleet, pointed } = useOperating();
  const grown = usePaced(scene.history, EVERY_MS.live);
  usePaced(scene.time, EVERY_MS[scene.mode]);
  const { history } = grown;
  const now = scene.now();
  const plot = useRef<HTMLDivElement>(null);
  const scale = textScale.value;
  const axis_px = (useMedia(NARROW) ? NARROW_AXIS_PX : AXIS_PX) * scale;
  const marks_px = MARKS_PX * scale;
  const chart_px = CHART_PX * scale;
  const shown = useTimeWindow(plot);
  const { window, width } = shown;
  const range = rangeOf(window, width);
  const cursor = useCursor(plot, shown, onSeek);

  const chosen = useMemo(() => chosenOf(fleet.name), [fleet]);
  const known = history.fields();
  const vehicles = useMemo(() => fleet.vehicles.map(({ id }) => id), [fleet]);
  const resources = useMemo(() => [...vehicles, ...fleet.payloads.map(({ id }) => id)], [fleet]);
  const wanted = new Set(chosen.value.resources ?? vehicles.slice(0, FIRST_RESOURCES));
  const plotted = resources.filter((id) => wanted.has(id));
  const fields = chosen.value.fields.filter((field) => known.includes(field));
  const at = pointed.value ?? now;
  const times = marks(window, width, 70 * scale);
  const label = (field: string) =>
    fill(text.chart, { field: titleOf(field), resources: plotted.join(", ") });

  return (
    <Pane
      title={strings.operate.panes.plots}
      class="plots-pane"
      scrolls
      tools={
        <TimeTools shown={shown}>
          <Chooser
            label={text.chooseFields}
            all={[...new Set([...chosen.value.fields, ...known])].map((id) => ({
              id,
              title: titleOf(id),
            }))}
            chosen={chosen.value.fields}
            onChange={(changed) => choose(chosen, fleet.name, { fields: changed })}
          />
          <Chooser
            label={text.chooseResources}
            all={resources.map((id) => ({ id, title: id }))}
            chosen={plotted}
            onChange={(changed) => choose(chosen, fleet.name, { resources: changed })}
          />
          <button
            type="button"
            class="plain"
            title={text.csvHint}
            disabled={fields.length === 0 || plotted.length === 0}
            onClick={() =>
              download(
                `${scene.run || "rehearsal"}-telemetry.csv`,
                csvOf(history, plotted, fields, range),
              )
            }
          >
            {text.csv}
          </button>
        </TimeTools>
      }
    >
      <div class="plots" style={`--axis: ${axis_px}px`}>
        {known.length === 0 && (
          <p class="nothing">{scene.hasTelemetry ? text.nothingYet : strings.operate.map.notKnown}</p>
        )}
        {known.length > 0 && (fields.length === 0 || plotted.length === 0) && (
          <p class="nothing">{text.choose}</p>
        )}
        <div class="plots-charts">
          <svg class="plots-marks" height={marks_px} aria-hidden="true">
            {times.map((t) => (
              <text key={t} x={axis_px + Math.max(16 * scale, (t - window.from_s) * window.px_per_s)} y={14 * scale}>
                {clock(t)}
              </text>
            ))}
          </svg>
          {fields.map((field) => (
            <Chart
              key={field}
              history={grown}
              field={field}
              title={titleOf(field)}
              label={label(field)}
              resources={plotted}
              range={range}
              width={width + axis_px}
              axis_px={axis_px}
              height={chart_px - TITLE_PX * scale}
              marks={times}
            />
          ))}
          {/* Above the charts, exactly where times are drawn. */}
          <div
            ref={plot}
            class={onSeek ? "plots-times plots-seek" : "plots-times"}
            role="slider"
            tabIndex={0}
            aria-label={text.label}
            aria-valuemin={Math.floor(range.from_s)}
            aria-valuemax={Math.ceil(range.to_s)}
            aria-valuenow={Math.round(at)}
            aria-valuetext={clock(at)}
            title={fill(text.keys, { seek: onSeek ? text.seek : "" })}
            {...cursor}
          >
            {now >= range.from_s && now <= range.to_s && (
              <div class="plots-now" style={`left: ${(now - window.from_s) * window.px_per_s}px`} />
            )}
            <TimeCursor window={window} />
            <PlotTip
              history={history}
              fields={fields}
              resources={plotted}
              window={window}
              width={width}
              top_px={marks_px}
              chart_px={chart_px}
            />
          </div>
        </div>
        {fields.length > 0 && plotted.length > 0 && (
          <ValuesTable
            history={history}
            resources={plotted}
            fields={fields}
            t={at}
            isNow={pointed.value === null}
          />
        )}
      </div>
    </Pane>
  );
}

function download(name: string, content: string): void {
  const address = URL.createObjectURL(new Blob([content], { type: "text/csv" }));
  const link = document.createElement("a");
  link.href = address;
  link.download = name;
  link.click();
  URL.revokeObjectURL(address);
}

