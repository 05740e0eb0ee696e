import { describe, expect, it } from "vitest";
import type { VehicleState } from "../../shared/types";
import { TelemetryTrack } from "./telemetryTrack";

const at = (resource: string, time_us: number) => ({ resource, time_us }) as VehicleState;

const track = () =>
  new TelemetryTrack([
    { t: 0, vehicles: { a: at("a", 0), b: at("b", 0) } },
    { t: 1, vehicles: { a: at("a", 1) } },
    { t: 2, vehicles: { a: at("a", 2) } },
  ]);

describe("telemetry track", () => {
  it("has what was last heard of each", () => {
    const { vehicles } = track().at(1.5);
    expect([vehicles.a!.time_us, vehicles.b!.time_us]).toEqual([1, 0]);
  });

  it("goes back as well", () => {
    const there = track();
    there.at(2);
    expect(there.at(0.5).vehicles.a!.time_us).toBe(0);
    expect(there.at(-1).vehicles).toEqual({});
  });

  it("says for how long nobody heard of one", () => {
    const there = track();
    there.at(1.5);
    expect(there.silentFor_s("a", 1.5)).toBe(0.5);
    expect(there.silentFor_s("b", 1.5)).toBe(1.5);
    expect(there.silentFor_s("c", 1.5)).toBeNull();
  });
});
