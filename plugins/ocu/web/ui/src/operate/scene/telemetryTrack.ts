// Where everybody was at any moment of a rehearsal, or of a run as far as that was kept.
import { longestStep_s, pieces } from "../map/trail";
import type { Detection, GeoPosition, PayloadState, TeamState, VehicleState } from "../../shared/types";

export interface TelemetrySample {
  t: number;
  vehicles: Record<string, VehicleState>;
  payloads?: Record<string, PayloadState>;
  teams?: Record<string, TeamState>;
  detections?: readonly Detection[];
  more_detections?: number;
}

export interface Telemetry {
  samples: readonly TelemetrySample[];
  /** Samples say what is new, and nothing while nothing is: then silence is no sign of a loss. */
  onlyNews: boolean;
  /** Why there are gaps; null: nothing went wrong. */
  problem: string | null;
}

export const NO_TELEMETRY: Telemetry = { samples: [], onlyNews: true, problem: null };

type States = Required<Pick<TelemetrySample, "vehicles" | "payloads" | "teams">>;

export class TelemetryTrack {
  private index = -1;
  private states: States = { vehicles: {}, payloads: {}, teams: {} };
  private readonly places = new Map<string, { t: number; position: GeoPosition }[]>();
  private readonly heard_s = new Map<string, number>();
  private readonly longest_s = new Map<string, number>();

  private readonly samples: readonly TelemetrySample[];
  private readonly onlyNews: boolean;

  constructor({ samples, onlyNews }: Pick<Telemetry, "samples" | "onlyNews">) {
    this.samples = samples;
    this.onlyNews = onlyNews;
    for (const { t, vehicles } of samples) {
      for (const [resource, { position }] of Object.entries(vehicles)) {
        if (!position) continue;
        const places = this.places.get(resource);
        if (places) places.push({ t, position });
        else this.places.set(resource, [{ t, position }]);
      }
    }
  }

  get moves(): boolean {
    return this.samples.length > 0;
  }

  /** When anything is known first, in seconds. */
  get begin(): number {
    return this.samples[0]?.t ?? Infinity;
  }

  at(t: number): States {
    if ((this.samples[this.index]?.t ?? -Infinity) > t) this.rewind();
    let next = this.samples[this.index + 1];
    while (next && next.t <= t) {
      this.index += 1;
      this.take(next);
      next = this.samples[this.index + 1];
    }
    return this.states;
  }

  silentFor_s(resource: string, t: number): number | null {
    const heard_s = this.heard_s.get(resource);
    if (heard_s === undefined) return null;
    return this.onlyNews ? 0 : Math.max(0, t - heard_s);
  }

  /** Where a vehicle has been up to then, the newest last, cut at gaps; at most `most` places. */
  trail(resource: string, t: number, most: number): GeoPosition[][] {
    const places = this.places.get(resource) ?? [];
    const count = countUpTo(places, t);
    return pieces(places.slice(Math.max(0, count - most), count), this.longestStep_s(resource));
  }

  private longestStep_s(resource: string): number {
    const known = this.longest_s.get(resource) ?? longestStep_s(this.places.get(resource) ?? []);
    this.longest_s.set(resource, known);
    return known;
  }

  private rewind(): void {
    this.index = -1;
    this.states = { vehicles: {}, payloads: {}, teams: {} };
    this.heard_s.clear();
  }

  private take({ t, vehicles, payloads = {}, teams = {} }: TelemetrySample): void {
    this.states = {
      vehicles: { ...this.states.vehicles, ...vehicles },
      payloads: { ...this.states.payloads, ...payloads },
      teams: { ...this.states.teams, ...teams },
    };
    for (const resource of Object.keys({ ...vehicles, ...payloads })) this.heard_s.set(resource, t);
  }
}

/** How many of them there are up to and at a time. */
function countUpTo(timed: readonly { t: number }[], t: number): number {
  let [low, high] = [0, timed.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (timed[middle]!.t <= t) low = middle + 1;
    else high = middle;
  }
  return low;
}
