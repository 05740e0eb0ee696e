import { describe, expect, it } from "vitest";
import type { RunRecord } from "../shared/types";
import { Reel, type ReelPage } from "./reel";
import { apply, emptyView, type PageView } from "./runView";
import { loop, RECORDS } from "./testing";

const PAGE = 100;

function pageView(records: readonly RunRecord[]): PageView {
  const view = emptyView();
  for (const record of records) apply(view, record);
  const { prompts, commands, holders, requirements, ...fields } = view;
  return structuredClone({
    ...fields,
    prompts: Object.fromEntries(prompts),
    commands: Object.fromEntries(commands),
    holders: Object.fromEntries(holders),
    requirements: Object.fromEntries(requirements),
  });
}

/** A reel of these records, and the pages that it has read so far. */
function reelOf(records: readonly RunRecord[], page = PAGE) {
  const read: number[] = [];
  const times = records.filter(({ seq }) => seq % page === 0).map(({ t }) => t);
  const head = { records: records.length, end: records.at(-1)?.t ?? 0, page, times };
  const reel = new Reel(head, async (number): Promise<ReelPage> => {
    read.push(number);
    const start = number * page;
    return {
      view: pageView(records.slice(0, start)),
      records: records.slice(start, start + page),
    };
  });
  return { reel, read };
}

describe("reel", () => {
  it("shows the same as all records, however one came there", async () => {
    const records = loop(2050);
    const { reel } = reelOf(records);
    for (const count of [2050, 10, 1000, 999, 900, 901, 0, 100, 1, 2000, 1999]) {
      const view = emptyView();
      for (const record of records.slice(0, count)) apply(view, record);
      await reel.read(reel.pageOf(count));
      expect(reel.after(count), `after ${count}`).toEqual(view);
    }
  });

  it("finds how many records there are up to a time", async () => {
    const { reel } = reelOf(RECORDS, 4);
    const counts: number[] = [];
    for (const t of [-1, 0, 4.5, 9, 100]) {
      await reel.read(reel.pageAt(t));
      counts.push(reel.countAt(t));
    }
    expect(counts).toEqual([0, 3, 8, 14, 14]);
    expect(reel.end).toBe(9);
    await reel.read(reel.pageOf(8));
    expect(reel.timeOf(8)).toBe(4);
  });

  it("has the whole last page at the end, though that is full", async () => {
    const { reel } = reelOf(RECORDS.slice(0, 8), 4);
    await reel.read(reel.pageAt(Infinity));
    expect(reel.countAt(Infinity)).toBe(8);
    expect(reel.after(8, reel.pageAt(Infinity)).seq).toBe(8);
  });

  it("reads each page once, and keeps a bounded number of them", async () => {
    const { reel, read } = reelOf(loop(PAGE * 60));
    await Promise.all([reel.read(3), reel.read(3), reel.read(-1), reel.read(60)]);
    expect(read).toEqual([3]);
    for (let page = 0; page < 60; page += 1) await reel.read(page);
    const kept = [...Array(60).keys()].filter((page) => reel.has(page));
    expect(kept).toEqual([...Array(24).keys()].map((back) => 36 + back));
  });

  it("has the records of pages that are here, in order", async () => {
    const { reel } = reelOf(loop(500));
    for (const page of [2, 1, 3]) await reel.read(page);
    expect(reel.between(1, 350).map(({ seq }) => seq)).toEqual(
      [...Array(250).keys()].map((number) => 101 + number),
    );
    expect(reel.between(0, 350)).toEqual([]);
  });

  it("reads a page again that could not be read", async () => {
    let fails = true;
    const head = { records: 1, end: 0, page: PAGE, times: [] };
    const reel = new Reel(head, async () => {
      if (fails) throw new Error("no connection");
      return { view: pageView([]), records: RECORDS.slice(0, 1) };
    });
    await expect(reel.read(0)).rejects.toThrow("no connection");
    fails = false;
    await reel.read(0);
    expect(reel.after(1).seq).toBe(1);
  });

  it("is empty without records", async () => {
    const { reel } = reelOf([]);
    await reel.read(reel.pageAt(5));
    expect(reel.after(5)).toEqual(emptyView());
    expect(reel.end).toBe(0);
  });
});
