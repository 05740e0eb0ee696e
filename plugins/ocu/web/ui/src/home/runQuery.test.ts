import { expect, test } from "vitest";
import { ALL_RUNS, mayDo, pathOf, sortedBy } from "./runQuery";

const asked = (more: Partial<typeof ALL_RUNS>, now_ms = 0) =>
  Object.fromEntries(new URLSearchParams(pathOf({ ...ALL_RUNS, ...more }, now_ms).split("?")[1]));

test("a page is asked for by what is set", () => {
  expect(asked({})).toEqual({ sort: "active", descending: "true", offset: "0", limit: "25" });
  expect(asked({ text: " a b ", vehicle: "uav1", page: 2 })).toMatchObject({
    text: "a b",
    vehicle: "uav1",
    offset: "50",
  });
});

test("statuses are chosen together or one by one", () => {
  const path = pathOf({ ...ALL_RUNS, status: "goingOn" }, 0);
  expect(path).toContain("status=running&status=paused");
  expect(asked({ status: "failed" })).toMatchObject({ status: "failed" });
});

test("the time is counted back from the minute", () => {
  expect(asked({ within_s: 3600 }, 7_261_000)).toMatchObject({ since_us: "3660000000" });
});

test("a second click on a head sorts the other way, from the first page on", () => {
  const once = sortedBy({ ...ALL_RUNS, page: 3 }, "mission");
  expect(once).toMatchObject({ sort: "mission", descending: false, page: 0 });
  expect(sortedBy(once, "mission").descending).toBe(true);
  expect(sortedBy(once, "took").descending).toBe(true);
});

test("only what goes on is paused, and only what is paused goes on", () => {
  expect(mayDo("pause", "running")).toBe(true);
  expect(mayDo("pause", "paused")).toBe(false);
  expect(mayDo("resume", "paused")).toBe(true);
  expect(mayDo("stop", "interrupted")).toBe(true);
  expect(mayDo("stop", "completed")).toBe(false);
});
