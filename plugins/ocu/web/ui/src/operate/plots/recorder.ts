// Keeps the numbers of a run that goes on, a few times in a second.
import type { PayloadState, VehicleState } from "../../shared/types";
import { AGE, SILENT_S, type TelemetryHistory } from "./history";
import type { State } from "./fields";

export interface States {
  vehicles: Record<string, VehicleState>;
  payloads: Record<string, PayloadState>;
}

/** Least seconds of the clock on the wall between two values. */
export const SPACING_S = 0.5;

export class HistoryRecorder {
  private readonly taken = new Map<string, State>();
  private taken_ms = -Infinity;
  private taken_s = -Infinity;

  constructor(readonly history: TelemetryHistory) {}

  /** Whether something was added. `silentFor_s`: seconds since the last state of a resource. */
  take(
    t_s: number,
    now_ms: number,
    { vehicles, payloads }: States,
    silentFor_s: (resource: string) => number | null,
  ): boolean {
    // While a run is paused, its time stands still.
    if (now_ms - this.taken_ms < SPACING_S * 1000 || t_s <= this.taken_s) return false;
    this.taken_ms = now_ms;
    this.taken_s = t_s;
    for (const states of [vehicles, payloads]) {
      for (const resource in states) {
        const state: State = states[resource]!;
        const silent_s = silentFor_s(resource) ?? 0;
        this.history.put(t_s, resource, AGE, silent_s);
        if (this.taken.get(resource) !== state) {
          this.history.add(t_s, state);
          this.taken.set(resource, state);
        } else if (silent_s > SILENT_S) {
          this.history.cut(t_s, resource);
        }
      }
    }
    return true;
  }
}
