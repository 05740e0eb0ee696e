import { describe, expect, it } from "vitest";
import { Turns } from "./turns";

const nothing = () => false;

describe("turns of cards", () => {
  it("come to all at once while they are few", () => {
    const turns = new Turns();
    for (let time = 0; time < 3; time += 1) {
      expect(turns.take(30, nothing)).toEqual(Array(30).fill(true));
    }
  });

  it("come to each of many in time, and to those in view always", () => {
    const turns = new Turns();
    const had = Array<number>(100).fill(0);
    for (let time = 0; time < 4; time += 1) {
      const now = turns.take(100, (index) => index === 77);
      expect(now.filter(Boolean).length).toBeLessThanOrEqual(31);
      now.forEach((has, index) => (had[index]! += Number(has)));
    }
    expect(Math.min(...had)).toBeGreaterThan(0);
    expect(had[77]).toBe(4);
  });
});
