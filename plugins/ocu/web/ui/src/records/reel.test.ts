import { describe, expect, it } from "vitest";
import { Reel } from "./reel";
import { apply, emptyView } from "./runView";
import { loop, RECORDS } from "./testing";

describe("reel", () => {
  it("shows the same, however one came there", () => {
    const records = loop(9001);
    const reel = new Reel(records);
    for (const count of [9001, 10, 4500, 4499, 4000, 4001, 0, 6000, 2000, 1999, 9000]) {
      const view = emptyView();
      for (const record of records.slice(0, count)) apply(view, record);
      expect(reel.after(count), `after ${count}`).toEqual(view);
    }
  });

  it("finds how many records there are up to a time", () => {
    const reel = new Reel(RECORDS);
    expect(reel.countAt(-1)).toBe(0);
    expect(reel.countAt(0)).toBe(3);
    expect(reel.countAt(4.5)).toBe(8);
    expect(reel.countAt(100)).toBe(14);
    expect(reel.end).toBe(9);
  });

  it("is empty without records", () => {
    const reel = new Reel([]);
    expect(reel.after(5)).toEqual(emptyView());
    expect(reel.end).toBe(0);
  });
});
