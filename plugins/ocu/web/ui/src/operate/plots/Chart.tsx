// One quantity of several vehicles and payloads over time, on a canvas.
import { useEffect, useRef } from "preact/hooks";
import uPlot from "uplot";
import { theme } from "../../shared/theme";
import { strings } from "../../strings";
import { LINK_LEVELS } from "./fields";
import type { TelemetryHistory } from "./history";
import { drawn, grid, type Range } from "./series";
import { lineOf, means } from "./style";
import "uplot/dist/uPlot.min.css";
import { textScale } from "../../shared/textScale";

/** Pixels of a column, of which the least and the greatest value are drawn. */
const COLUMN_PX = 2;

export interface ChartProps {
  history: { history: TelemetryHistory };
  field: string;
  title: string;
  /** For screen readers. */
  label: string;
  resources: readonly string[];
  range: Range;
  /** With the axis of the values, which has `axis_px` of it. */
  width: number;
  height: number;
  axis_px: number;
  marks: number[];
}

export function Chart(props: ChartProps) {
  const { history, field, title, label, resources, range, width, height, axis_px, marks } = props;
  const host = useRef<HTMLDivElement>(null);
  const chart = useRef<uPlot>();
  const axis = useRef({ range, marks });
  axis.current = { range, marks };
  const names = resources.join("\n");

  useEffect(() => {
    const box = host.current!;
    const style = getComputedStyle(box);
    const rule = style.getPropertyValue("--rule").trim();
    const isLink = field === "link";
    const options: uPlot.Options = {
      width,
      height,
      padding: [6, 0, 8, 0],
      legend: { show: false },
      cursor: { show: false },
      scales: {
        x: { time: false, range: () => [axis.current.range.from_s, axis.current.range.to_s] },
        y: { range: (_, least, greatest) => limitsOf(field, least, greatest) },
      },
      axes: [
        {
          size: 0,
          splits: () => axis.current.marks,
          values: () => [],
          grid: { stroke: rule, width: 1 },
          ticks: { show: false },
        },
        {
          size: axis_px,
          stroke: style.color,
          font: `${11 * textScale.value}px system-ui, sans-serif`,
          space: 26 * textScale.value,
          grid: { stroke: rule, width: 1 },
          ticks: { stroke: rule, width: 1, size: 4 },
          ...(isLink && {
            splits: () => LINK_LEVELS.map((_, level) => level),
            values: () => LINK_LEVELS.map((level) => strings.plots.links[level]),
          }),
        },
      ],
      series: [
        {},
        ...resources.map((resource, index) => {
          const { colour, dash, width: px } = lineOf(index, box, means.peek());
          return {
            label: resource,
            stroke: colour,
            width: px,
            dash,
            points: { show: false },
            ...(isLink && { paths: uPlot.paths.stepped!({ align: 1 }) }),
          };
        }),
      ],
    };
    const made = new uPlot(options, [[], ...resources.map(() => [])], box);
    chart.current = made;
    return () => {
      chart.current = undefined;
      made.destroy();
    };
  }, [field, names, theme.value, means.value, axis_px]);

  useEffect(() => chart.current?.setSize({ width, height }), [width, height]);

  useEffect(() => {
    const columns = Math.max(10, Math.floor((width - axis_px) / COLUMN_PX));
    const data = resources.map((resource) => {
      const series = history.history.series(resource, field);
      return series ? drawn(series, range, columns) : [];
    });
    chart.current?.setData([grid(range, columns), ...data]);
  }, [history, field, names, range.from_s, range.to_s, width, theme.value, means.value, axis_px]);

  return (
    <div class="plot" role="img" aria-label={label}>
      <strong aria-hidden="true">{title}</strong>
      <div ref={host} class="plot-canvas" />
    </div>
  );
}

/** Of the axis of values. A line that does not change is in the middle. */
function limitsOf(field: string, least: number | null, greatest: number | null): [number, number] {
  if (field === "link") return [-0.2, LINK_LEVELS.length - 0.6];
  if (field === "battery_percent") return [0, 105];
  if (least === null || greatest === null) return [0, 1];
  const room = Math.max((greatest - least) * 0.12, Math.abs(greatest) * 1e-6, 0.05);
  return [least - room, greatest + room];
}
