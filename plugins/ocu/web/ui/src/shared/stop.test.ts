import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { ARMED_MS, BETWEEN_MS, TwoPresses } from "./stop";

let stops: number;
let stop: TwoPresses;

beforeEach(() => {
  vi.useFakeTimers();
  stops = 0;
  stop = new TwoPresses(
    () => void (stops += 1),
    () => Date.now(),
  );
});

afterEach(() => void vi.useRealTimers());

describe("two presses", () => {
  it("stop at the second one", () => {
    stop.press();
    expect([stops, stop.armed.value]).toEqual([0, true]);
    vi.advanceTimersByTime(1000);
    stop.press();
    expect([stops, stop.armed.value]).toEqual([1, false]);
  });

  it("only arm, if they are a double click", () => {
    stop.press();
    vi.advanceTimersByTime(BETWEEN_MS - 1);
    stop.press();
    expect([stops, stop.armed.value]).toEqual([0, true]);
  });

  it("do nothing if the second comes too late", () => {
    stop.press();
    vi.advanceTimersByTime(ARMED_MS);
    expect(stop.armed.value).toBe(false);
    stop.press();
    expect(stops).toBe(0);
  });

  it("are not needed if one holds", () => {
    stop.held();
    expect(stops).toBe(1);
  });
});
