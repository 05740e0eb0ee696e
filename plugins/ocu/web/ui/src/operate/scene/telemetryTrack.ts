// Where everybody was at any moment of a rehearsal.
import type { PayloadState, TeamState, VehicleState } from "../../shared/types";

export interface TelemetrySample {
  t: number;
  vehicles: Record<string, VehicleState>;
  payloads?: Record<string, PayloadState>;
  teams?: Record<string, TeamState>;
}

type States = Required<Omit<TelemetrySample, "t">>;

export class TelemetryTrack {
  private index = -1;
  private states: States = { vehicles: {}, payloads: {}, teams: {} };
  private readonly heard_s = new Map<string, number>();

  constructor(private readonly samples: readonly TelemetrySample[]) {}

  get moves(): boolean {
    return this.samples.length > 0;
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
    return heard_s === undefined ? null : Math.max(0, t - heard_s);
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
