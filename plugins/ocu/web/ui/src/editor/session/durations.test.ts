import { describe, expect, it } from "vitest";
import {
  isoCycleOf,
  isoOf,
  quantityOf,
  shownCycle,
  shownDuration,
  writtenDuration,
} from "./durations";

const DURATIONS: [typed: string, iso: string, shown: string][] = [
  ["5 min", "PT5M", "5 min"],
  ["5min", "PT5M", "5 min"],
  ["5 minutes", "PT5M", "5 min"],
  ["90 s", "PT90S", "90 s"],
  ["1 h 30 min", "PT1H30M", "1 h 30 min"],
  ["1h30m", "PT1H30M", "1 h 30 min"],
  ["1 hour and 30 minutes", "PT1H30M", "1 h 30 min"],
  ["2 days, 3 hours", "P2DT3H", "2 d 3 h"],
  ["0.5 s", "PT0.5S", "0.5 s"],
  ["an hour", "PT1H", "1 h"],
  ["five minutes", "PT5M", "5 min"],
  ["1 week", "P1W", "1 week"],
  ["PT5M", "PT5M", "5 min"],
  ["P1DT2H", "P1DT2H", "1 d 2 h"],
];

describe("durations", () => {
  it.each(DURATIONS)("%s", (typed, iso, shown) => {
    expect(isoOf(typed)).toBe(iso);
    expect(shownDuration(iso)).toBe(shown);
    expect(isoOf(shown)).toBe(iso);
  });

  it.each(["", "5", "soon", "5 km", "30 min 1 h", "5 min 5 min", "P", "PT", "5 min later"])(
    "is none: %s",
    (typed) => expect(isoOf(typed)).toBeUndefined(),
  );

  it("stay as they stand where they are no plain durations", () => {
    expect(shownDuration("P1M")).toBe("P1M");
    expect(shownDuration("${pause}")).toBe("${pause}");
    expect(writtenDuration(" ${pause} ")).toBe("${pause}");
    expect(writtenDuration("soon")).toBe("soon");
  });

  it("are quantities where a behavior takes one", () => {
    expect(quantityOf("1 h 30 min")).toBe("90 min");
    expect(quantityOf("1 min 5 s")).toBe("65 s");
    expect(quantityOf("2 days")).toBe("48 h");
    expect(quantityOf("30 s")).toBe("30 s");
    expect(quantityOf("30")).toBe("30");
    expect(quantityOf("PT30S")).toBe("PT30S");
  });
});

describe("cycles", () => {
  it.each([
    ["3 times every 10 s", "R3/PT10S", "3 times every 10 s"],
    ["every 10 s, 3 times", "R3/PT10S", "3 times every 10 s"],
    ["every 5 minutes", "R/PT5M", "every 5 min"],
    ["every hour", "R/PT1H", "every 1 h"],
    ["R/2026-01-01T00:00:00Z/PT1H", "R/2026-01-01T00:00:00Z/PT1H", "R/2026-01-01T00:00:00Z/PT1H"],
    ["0 8 * * *", "0 8 * * *", "0 8 * * *"],
  ])("%s", (typed, iso, shown) => {
    expect(isoCycleOf(typed)).toBe(iso);
    expect(shownCycle(iso)).toBe(shown);
  });
});
