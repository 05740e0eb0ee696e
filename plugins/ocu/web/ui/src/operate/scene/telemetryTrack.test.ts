import { describe, expect, it } from "vitest";
import type { VehicleState } from "../../shared/types";
import { TelemetryTrack } from "./telemetryTrack";

const at = (resource: string, time_us: number) => {
  const position = { latitude_deg: time_us, longitude_deg: 0, altitude_m: 0 };
  return { resource, time_us, position } as VehicleState;
};

const samples = [
  { t: 0, vehicles: { a: at("a", 0), b: at("b", 0) } },
  { t: 1, vehicles: { a: at("a", 1) } },
  { t: 2, vehicles: { a: at("a", 2) } },
];

const track = (onlyNews = false) => new TelemetryTrack({ samples, onlyNews });

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

  it("takes silence for no loss where only news are told", () => {
    const there = track(true);
    there.at(1.5);
    expect([there.silentFor_s("b", 1.5), there.silentFor_s("c", 1.5)]).toEqual([0, null]);
  });

  it("knows the way to any moment, of which the newest places count", () => {
    const there = track();
    const way = (t: number, most: number) =>
      there.trail("a", t, most).flat().map(({ latitude_deg }) => latitude_deg);
    expect(way(1.5, 10)).toEqual([0, 1]);
    expect(way(Infinity, 2)).toEqual([1, 2]);
    expect(way(-1, 10)).toEqual([]);
    expect(there.trail("c", 2, 10)).toEqual([]);
  });

  it("says from when on anything is known", () => {
    expect(track().begin).toBe(0);
    expect(new TelemetryTrack({ samples: [], onlyNews: true }).begin).toBe(Infinity);
  });
});
