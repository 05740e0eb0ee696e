import { describe, expect, it } from "vitest";
import { counts, linesOf, matching, sorted, type Row } from "./rows";
import { had, rows, state, vehicle } from "./testing";

const names = (found: readonly Row[]) => found.map(({ id }) => id);

describe("rows", () => {
  it("say the worst of a vehicle's health", () => {
    const found = rows({
      vehicles: ["v1", "v2", "v3", "v4", "v5", "v6", "v7"].map((id) => vehicle(id)),
      states: [
        state("v1"),
        state("v2", { link: "degraded" }),
        state("v3", { battery_fraction: 0.2, link: "degraded" }),
        state("v4", { ready: false, battery_fraction: 0.2 }),
        state("v5", { ready: false, link: "lost" }),
        state("v7"),
      ],
      silent: { v7: 9 }, // within its `lost_after`: it is lost when the executive says so
    });
    expect(found.map(({ health }) => health)).toEqual([
      "ok",
      "degraded",
      "lowBattery",
      "notReady",
      "lost",
      "unheard",
      "ok",
    ]);
    expect(found[0]!.speed).toBe(5);
    expect(counts(found, true)).toEqual({
      lost: 2,
      notReady: 2,
      lowBattery: 2,
      free: 7,
      taken: 0,
      inRun: 0,
    });
  });

  it("say that nothing is known while the executive is not connected, and nothing of a loss", () => {
    const found = rows({
      vehicles: [vehicle("v1"), vehicle("v2")],
      states: [state("v1"), state("v2", { link: "lost" })],
      silent: { v1: 90, v2: 90 },
      unknownSince: Date.UTC(2026, 0, 1, 12, 0, 5),
    });
    expect(found.map(({ health }) => health)).toEqual(["unknown", "unknown"]);
    expect(found.map(({ flags }) => flags.lost)).toEqual([false, true]);
  });

  it("are free when their link is back and they are held, not while they are lost", () => {
    const found = rows({
      vehicles: [vehicle("v1"), vehicle("v2")],
      status: {
        v1: had({ unavailable: "returned: held" }),
        v2: had({ unavailable: "lost: its link" }),
      },
    });
    expect(found.map(({ flags }) => flags.free)).toEqual([true, false]);
  });

  it("say who has a vehicle", () => {
    const found = rows({
      vehicles: [vehicle("v1"), vehicle("v2"), vehicle("v3"), vehicle("v4"), vehicle("m", { manned: true })],
      status: {
        v1: had({ holder: "r1.b3", run: "r1", task: "Survey" }),
        v2: had({ holder: "ben", run: "r2", task: "goto", direct: true, by: "ben" }),
        v4: had({ holder: "r3.b1", run: "r3", task: "goto", direct: true, by: "ben" }),
      },
    });
    expect(found.map(({ operator }) => operator)).toEqual(["", "ben", "", "", ""]);
    expect(found.map(({ flags }) => [flags.free, flags.taken, flags.inRun])).toEqual([
      [false, false, true],
      [false, true, false],
      [true, false, false],
      [false, false, true],
      [false, false, false],
    ]);
    expect(names(matching(found, { search: "r1 surv", filters: new Set(), withPayloads: true })))
      .toEqual(["v1"]);
    const chosen = { search: "", filters: new Set(["free", "taken"] as const), withPayloads: true };
    expect(names(matching(found, chosen))).toEqual(["v2", "v3"]);
  });

  it("are sorted as people count, what is not known last", () => {
    const found = rows({
      vehicles: ["v10", "v9", "v1"].map((id) => vehicle(id)),
      states: [state("v10", { battery_fraction: 0.5 }), state("v9", { battery_fraction: 0.1 })],
    });
    const by = (column: "name" | "battery", descending: boolean) =>
      names(sorted(found, { column, descending }));
    expect(by("name", false)).toEqual(["v1", "v9", "v10"]);
    expect(by("battery", false)).toEqual(["v9", "v10", "v1"]);
    expect(by("battery", true)).toEqual(["v10", "v9", "v1"]);
  });

  it("are grouped, by health the worst first", () => {
    const found = rows({
      vehicles: [vehicle("v1", { payloads: ["v1/ptz"] }), vehicle("v2", { domain: "air" })],
      states: [state("v1")],
    });
    expect(found.map(({ id, isPayload, arbiter }) => [id, isPayload, arbiter])).toEqual([
      ["v1", false, "sim"],
      ["v1/ptz", true, "onvif"],
      ["v2", false, "sim"],
    ]);
    const all = matching(found, { search: "", filters: new Set(), withPayloads: false });
    const heads = (grouping: "health" | "domain") =>
      linesOf(all, grouping).map((line) => (line.kind === "group" ? line.group : line.row.id));
    expect(heads("health")).toEqual(["unheard", "v2", "ok", "v1"]);
    expect(heads("domain")).toEqual(["air", "v2", "ground", "v1"]);
  });
});
