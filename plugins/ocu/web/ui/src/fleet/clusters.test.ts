import { describe, expect, it } from "vitest";
import { worstOf } from "../map/vehicleSymbols";
import { Clusters } from "./clusters";
import { rows, state, vehicle } from "./testing";

describe("clusters", () => {
  const spread = (count: number, step: number) =>
    rows({
      vehicles: Array.from({ length: count }, (_, index) => vehicle(`v${index}`)),
      states: Array.from({ length: count }, (_, index) =>
        state(`v${index}`, {
          position: { latitude_deg: 38, longitude_deg: -77 + index * step, altitude_m: 0 },
          ready: index !== 3,
        }),
      ),
    });
  const WORLD: [number, number, number, number] = [-180, -85, 180, 85];

  it("are drawn of many, with the worst health, and come apart near by", () => {
    const clusters = new Clusters();
    clusters.load(spread(1000, 1e-4));
    const [far] = clusters.marks(WORLD, 3);
    expect(far).toMatchObject({ kind: "cluster", count: 1000, healths: { ok: 999, notReady: 1 } });
    const near = clusters.marks([-77.0001, 37.9, -76.9989, 38.1], 20.5);
    expect(near.map(({ kind }) => kind)).toEqual(Array(near.length).fill("vehicle"));
    expect(near.length).toBeGreaterThan(9);
  });

  it("have the worst health of their vehicles", () => {
    expect(worstOf({ ok: 9 })).toBe("ok");
    expect(worstOf({ lost: 1, ok: 9, notReady: 3 })).toBe("lost");
  });

  it("are not made of a few", () => {
    const clusters = new Clusters();
    clusters.load(spread(20, 0));
    expect(clusters.marks(WORLD, 3)).toHaveLength(20);
  });
});
