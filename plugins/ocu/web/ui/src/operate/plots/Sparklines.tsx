// Battery and link of the last minutes, small, on the card of a vehicle.
import { age, fixed } from "../../shared/format";
import { fill, strings } from "../../strings";
import { useOperating } from "../context";
import { LINK_LEVELS } from "./fields";
import { drawn, grid, type Drawn } from "./series";
import { readValue } from "./values";
import "./sparks.css";

const text = strings.plots;

const SPAN_S = 600;
const WIDTH = 54;
const HEIGHT = 18;
const COLUMNS = WIDTH / 3;

/** Drawn with its card. */
export function Sparklines({ resource }: { resource: string }) {
  const { scene } = useOperating();
  const { history } = scene.history.peek();
  const to_s = Math.max(1, scene.now());
  const range = { from_s: Math.max(0, to_s - SPAN_S), to_s };
  const times = grid(range, COLUMNS);
  const lineOf = (field: string, limits: readonly [number, number], stepped: boolean) => {
    const series = history.series(resource, field);
    return series ? pathOf(drawn(series, range, COLUMNS), times, limits, stepped) : "";
  };
  const span = age(to_s - range.from_s);
  const battery = lineOf("battery_percent", [0, 100], false);
  const link = lineOf("link", [0, LINK_LEVELS.length - 1], true);
  const link_series = history.series(resource, "link");
  const levels = link_series ? drawn(link_series, range, COLUMNS).filter(isKnown) : [];
  const worst = levels.length > 0 ? LINK_LEVELS[Math.round(Math.min(...levels))]! : null;
  return (
    <div class="sparks">
      {battery && (
        <Spark
          name={text.fields.battery_percent!}
          path={battery}
          label={fill(text.spark.battery, {
            span,
            from: firstOf(history.series(resource, "battery_percent"), range.from_s),
            to: readValue(history, resource, "battery_percent", to_s),
          })}
        />
      )}
      {link && (
        <Spark
          name={text.fields.link!}
          path={link}
          label={fill(text.spark.link, {
            span,
            worst: worst ? text.links[worst] : text.spark.unknown,
          })}
        />
      )}
    </div>
  );
}

function Spark({ name, path, label }: { name: string; path: string; label: string }) {
  return (
    <span class="spark" title={label}>
      <span aria-hidden="true">{name}</span>
      <svg width={WIDTH} height={HEIGHT} role="img" aria-label={label}>
        <path d={path} />
      </svg>
    </span>
  );
}

const isKnown = (value: Drawn): value is number => typeof value === "number";

/** The first value that is known from a time on. */
function firstOf(series: Parameters<typeof drawn>[0] | null, from_s: number): string {
  const at = series ? Math.max(0, series.countAt(from_s) - 1) : 0;
  const value = series && series.length > at ? series.valueAt(at) : NaN;
  return Number.isNaN(value) ? text.spark.unknown : `${fixed(value, 1)} %`;
}

/** An SVG path; gaps are gaps. */
export function pathOf(
  values: readonly Drawn[],
  times: readonly number[],
  [least, greatest]: readonly [number, number],
  stepped: boolean,
): string {
  const [from_s, to_s] = [times[0]!, times.at(-1)!];
  let [path, pen] = ["", false];
  values.forEach((value, index) => {
    if (value === undefined) return;
    if (value === null) {
      pen = false;
      return;
    }
    const x = (((times[index]! - from_s) / (to_s - from_s)) * WIDTH).toFixed(1);
    const part = Math.max(0, Math.min(1, (value - least) / (greatest - least)));
    const y = (1 + (1 - part) * (HEIGHT - 2)).toFixed(1);
    if (!pen) path += `M${x} ${y}h0.1`;
    else path += stepped ? `H${x}V${y}` : `L${x} ${y}`;
    pen = true;
  });
  return path;
}
