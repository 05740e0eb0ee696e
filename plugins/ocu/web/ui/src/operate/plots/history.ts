// All numbers of all vehicles and payloads over the time of a run, for plots. Bounded in size.
import { pieces, longestStep_s } from "../map/trail";
import type { GeoPosition } from "../../shared/types";
import type { Telemetry } from "../scene/telemetryTrack";
import { goesRound, numbersOf, type State } from "./fields";
import { MOST_VALUES, Series } from "./series";

/** Values of all series together: 64 MB. */
const MOST_OF_ALL = 4_000_000;
const LEAST_VALUES = 500;

/** After so many seconds without a state, nothing is known of a resource. */
export const SILENT_S = 5;
/** Before a new value, the one before held until about then. */
const HELD_S = 1;

/** Age of the last state, in seconds: it is known only of what is received here. */
export const AGE = "state_age_s";

export class TelemetryHistory {
  private readonly found = new Map<string, Map<string, Series>>();
  private readonly latest = new Map<string, State>();

  /** `expected`: how many vehicles and payloads there are, which share the room. */
  constructor(private readonly expected: number) {}

  get resources(): string[] {
    return [...this.found.keys()].sort();
  }

  /** The fields that some resource has, in the order of first sight. */
  fields(): string[] {
    return [...new Set([...this.found.values()].flatMap((fields) => [...fields.keys()]))];
  }

  series(resource: string, field: string): Series | null {
    return this.found.get(resource)?.get(field) ?? null;
  }

  /** Add a state. One whose link is lost says nothing but that: what it has besides is old. */
  add(t_s: number, state: State): void {
    this.latest.set(state.resource, state);
    if (state.link === "lost") {
      this.cut(t_s, state.resource, ["link", AGE]);
      this.put(t_s, state.resource, "link", 0);
      return;
    }
    const numbers = numbersOf(state);
    for (const [field, value] of numbers) this.put(t_s, state.resource, field, value);
    for (const [field, series] of this.found.get(state.resource)!) {
      if (!numbers.has(field) && field !== AGE) series.push(t_s, NaN);
    }
  }

  /** Nothing is known from here on, but of the fields that are named. */
  cut(t_s: number, resource: string, but: readonly string[] = [AGE]): void {
    for (const [field, series] of this.found.get(resource) ?? []) {
      if (!but.includes(field)) series.push(t_s, NaN);
    }
  }

  put(t_s: number, resource: string, field: string, value: number): void {
    let fields = this.found.get(resource);
    if (!fields) this.found.set(resource, (fields = new Map<string, Series>()));
    let series = fields.get(field);
    if (!series) fields.set(field, (series = new Series(this.most)));
    const before = series.length > 0 ? series.valueAt(series.length - 1) : NaN;
    if (goesRound(field, before, value)) series.push(t_s, NaN);
    series.push(t_s, value);
  }

  /** The values of the last state hold until then: where nothing is new, nothing was written. */
  hold(t_s: number, resource: string): void {
    const state = this.latest.get(resource);
    if (state) this.add(t_s, state);
  }

  private get most(): number {
    const fields = 12;
    const share = Math.floor(MOST_OF_ALL / (Math.max(1, this.expected) * fields));
    return Math.max(LEAST_VALUES, Math.min(MOST_VALUES, share));
  }
}

/** What a track has; where nothing is new, the last values hold up to `end_s`, if it is not null. */
export function historyOf(
  { samples, onlyNews }: Pick<Telemetry, "samples" | "onlyNews">,
  expected: number,
  end_s: number | null,
): TelemetryHistory {
  const history = new TelemetryHistory(expected);
  const moved = onlyNews ? jumpsOf(samples) : null;
  const last_s = new Map<string, number>();
  for (const { t, vehicles, payloads = {} } of samples) {
    for (const state of [...Object.values(vehicles), ...Object.values(payloads)]) {
      const { resource } = state;
      const before_s = last_s.get(resource) ?? t;
      if (!onlyNews) {
        if (t - before_s > SILENT_S) history.cut(before_s, resource);
        history.put(t, resource, AGE, 0);
      } else if (moved?.has(`${t} ${resource}`)) {
        history.cut(before_s, resource);
      } else if (t - before_s > 2 * HELD_S) {
        history.hold(t - HELD_S, resource);
      }
      history.add(t, state);
      last_s.set(resource, t);
    }
  }
  if (onlyNews && end_s !== null) {
    for (const resource of last_s.keys()) history.hold(end_s, resource);
  }
  return history;
}

/** When vehicles were found far from where they were: nobody has recorded them in between. */
function jumpsOf(samples: Telemetry["samples"]): Set<string> {
  const places = new Map<string, { t: number; position: GeoPosition }[]>();
  for (const { t, vehicles } of samples) {
    for (const [resource, { position }] of Object.entries(vehicles)) {
      if (!position) continue;
      const of = places.get(resource);
      if (of) of.push({ t, position });
      else places.set(resource, [{ t, position }]);
    }
  }
  const found = new Set<string>();
  for (const [resource, all] of places) {
    let count = 0;
    for (const piece of pieces(all, longestStep_s(all))) {
      if (count > 0) found.add(`${all[count]!.t} ${resource}`);
      count += piece.length;
    }
  }
  return found;
}
