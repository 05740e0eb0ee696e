import { describe, expect, it } from "vitest";
import type { PayloadState, VehicleState } from "../../shared/types";
import { csvOf } from "./csv";
import { numbersOf, unitOf, wordsOf } from "./fields";
import { AGE, historyOf, TelemetryHistory } from "./history";
import { HistoryRecorder } from "./recorder";
import { drawn, extremes, grid, Series } from "./series";

const state = (resource: string, more: Partial<VehicleState> = {}): VehicleState => ({
  resource,
  time_us: 0,
  position: null,
  altitude_above_home_m: 10,
  velocity_enu_m_s: [3, 4, 0],
  yaw_rad: 0,
  battery_fraction: 0.5,
  mode: "AUTO",
  armed: true,
  ready: true,
  not_ready_reasons: [],
  link: "connected",
  behavior: "",
  ...more,
});

const filled = (values: number[], most?: number): Series => {
  const series = new Series(most);
  values.forEach((value, index) => series.push(index, value));
  return series;
};

/** A series of these very values; a real one does not begin with a gap. */
const plain = (values: number[]): Series =>
  ({ valueAt: (index: number) => values[index] }) as unknown as Series;

describe("fields of a state", () => {
  it("are what people know, and every other number", () => {
    const numbers = numbersOf({ ...state("a"), fuel_l: 3, roll_rad: Math.PI } as VehicleState);
    expect(Object.fromEntries(numbers)).toEqual({
      link: 2,
      altitude_above_home_m: 10,
      speed_m_s: 5,
      climb_m_s: 0,
      heading_deg: 90,
      battery_percent: 50,
      fuel_l: 3,
      roll_deg: 180,
    });
    expect([unitOf("speed_m_s"), unitOf("altitude_above_home_m"), unitOf("zoom")]).toEqual([
      "m/s",
      "m",
      "",
    ]);
    expect(wordsOf("position.altitude_m")).toBe("Position altitude");
  });

  it("leave out what is not known, and corners", () => {
    const camera = { resource: "a/cam", link: "lost", zoom: 2, pan_rad: null } as PayloadState;
    const corners = [{ latitude_deg: 1, longitude_deg: 2, altitude_m: 3 }];
    expect(Object.fromEntries(numbersOf({ ...camera, footprint: corners }))).toEqual({
      link: 0,
      zoom: 2,
    });
  });
});

describe("a series", () => {
  it("has the value that holds at a time", () => {
    const series = filled([1, 2, NaN, 4]);
    expect([-1, 0, 1.5, 2.5, 9].map((t) => series.at(t))).toEqual([null, 1, 2, null, 4]);
  });

  it("keeps least, greatest and gaps when it is full", () => {
    const values = Array.from({ length: 400 }, (_, index) => (index === 123 ? 99 : index % 7));
    values[200] = NaN;
    const series = filled(values, 100);
    expect(series.length).toBeLessThanOrEqual(100);
    const kept = Array.from({ length: series.length }, (_, index) => series.valueAt(index));
    expect(Math.max(...kept.filter((value) => !Number.isNaN(value)))).toBe(99);
    expect(kept.some(Number.isNaN)).toBe(true);
  });

  it.each([
    [[NaN], [0]],
    [[1], [0]],
    [[NaN, 1], [0, 1]],
    [[2, NaN, 1], [0, 1, 2]],
    [[3, 3, NaN], [0, 2]],
    [[2, 5, 1, 4], [1, 2]],
  ])("has extremes in order of time: %s", (values, wanted) => {
    expect(extremes(plain(values), 0, values.length)).toEqual(wanted);
  });

  it("is drawn with the least and the greatest of each column", () => {
    const series = filled(Array.from({ length: 1000 }, (_, index) => (index === 500 ? 50 : 1)));
    const values = drawn(series, { from_s: 0, to_s: 1000 }, 10);
    expect(values.length).toBe(grid({ from_s: 0, to_s: 1000 }, 10).length);
    expect(values).toContain(50);
    expect(values.filter((value) => value !== undefined).length).toBeLessThan(32);
  });

  it("is drawn with gaps, and from edge to edge", () => {
    const series = filled([0, 10, NaN, 30, 40]);
    expect(drawn(series, { from_s: 0.5, to_s: 4 }, 4)).toContain(null);
    const part = drawn(series, { from_s: 0.2, to_s: 0.7 }, 4);
    expect([part[0], part.at(-1)]).toEqual([2, 7]);
    const gap = drawn(series, { from_s: 2.2, to_s: 2.7 }, 4);
    expect(gap.every((value) => value === undefined)).toBe(true);
  });
});

describe("the history of a run", () => {
  it("has a gap while a link is lost", () => {
    const samples = [
      { t: 0, vehicles: { a: state("a") } },
      { t: 2, vehicles: { a: state("a", { link: "lost" }) } },
      { t: 8, vehicles: { a: state("a", { battery_fraction: 0.4 }) } },
    ];
    const history = historyOf({ samples, onlyNews: true }, 1, 10);
    const battery = history.series("a", "battery_percent")!;
    expect([0, 1.5, 2, 5, 8, 10].map((t) => battery.at(t))).toEqual([50, 50, null, null, 40, 40]);
    const link = history.series("a", "link")!;
    expect([0, 2, 8].map((t) => link.at(t))).toEqual([2, 0, 2]);
  });

  it("holds a value until the next one of a track that has news only", () => {
    const samples = [
      { t: 0, vehicles: { a: state("a") } },
      { t: 100, vehicles: { a: state("a", { battery_fraction: 0.4 }) } },
    ];
    const battery = historyOf({ samples, onlyNews: true }, 1, 200).series("a", "battery_percent")!;
    const part = drawn(battery, { from_s: 0, to_s: 90 }, 3);
    expect(part.at(-1)).toBe(50);
    expect(battery.timeAt(battery.length - 1)).toBe(200);
  });

  it("has a gap where nobody recorded a vehicle that moved", () => {
    const at = (latitude_deg: number) => ({ latitude_deg, longitude_deg: 8, altitude_m: 0 });
    const samples = [0, 1, 2, 3, 100, 101].map((t) => ({
      t,
      vehicles: { a: state("a", { position: at(t < 50 ? 50 : 50.1) }) },
    }));
    const speed = historyOf({ samples, onlyNews: true }, 1, null).series("a", "speed_m_s")!;
    expect([2, 50, 100].map((t) => speed.at(t))).toEqual([5, null, 5]);
  });

  it("has a gap where a rehearsed vehicle was silent", () => {
    const samples = [0, 1, 20, 21].map((t) => ({ t, vehicles: { a: state("a") } }));
    const speed = historyOf({ samples, onlyNews: false }, 1, null).series("a", "speed_m_s")!;
    expect([1.5, 10, 21].map((t) => speed.at(t))).toEqual([null, null, 5]);
  });

  it("breaks the line of a heading that goes round", () => {
    const history = new TelemetryHistory(1);
    history.put(0, "a", "heading_deg", 350);
    history.put(1, "a", "heading_deg", 10);
    expect(history.series("a", "heading_deg")!.length).toBe(3);
  });

  it("is recorded twice a second, with the age of what was received", () => {
    const recorder = new HistoryRecorder(new TelemetryHistory(1));
    const states = { vehicles: { a: state("a") }, payloads: {} };
    let silent_s = 0;
    const take = (t: number) => recorder.take(t, t * 1000, states, () => silent_s);
    expect([take(0), take(0.2), take(0.6)]).toEqual([true, false, true]);
    silent_s = 7;
    take(7);
    const { history } = recorder;
    expect(history.series("a", "battery_percent")!.at(7)).toBe(null);
    expect(history.series("a", AGE)!.at(7)).toBe(7);
  });

  it("is bounded with a thousand vehicles", () => {
    const history = new TelemetryHistory(1000);
    for (let t = 0; t < 2000; t += 1) history.put(t, "a", "speed_m_s", t % 5);
    expect(history.series("a", "speed_m_s")!.length).toBeLessThanOrEqual(500);
  });
});

describe("a table of what is plotted", () => {
  it("has a row for each time and resource", () => {
    const history = new TelemetryHistory(2);
    history.put(0, "a", "speed_m_s", 1);
    history.put(0, "a", "battery_percent", 90);
    history.put(1, "b,c", "speed_m_s", 2.5);
    history.put(9, "a", "speed_m_s", 3);
    const fields = ["battery_percent", "speed_m_s"];
    const csv = csvOf(history, ["a", "b,c"], fields, { from_s: 0, to_s: 5 });
    expect(csv.split("\r\n")).toEqual([
      "time_s,resource,battery_percent,speed_m_s",
      "0.000,a,90,1",
      '1.000,"b,c",,2.5',
      "",
    ]);
  });
});
