// Runs that the server has indexed: the page's views and bars are those of the server.
import { describe, expect, it } from "vitest";
import type { ReplayHead } from "../operate/scene/replayScene";
import { Reel, type ReelPage } from "./reel";
import replayed from "./replayed.json";
import { apply, emptyView, viewOf } from "./runView";
import { Spans } from "./spans";

interface Replayed {
  head: ReplayHead;
  pages: ReelPage[];
}

const RUNS = Object.entries(replayed as unknown as Record<string, Replayed>);

describe.each(RUNS)("the replay of %s", (_, { head, pages }) => {
  const records = pages.flatMap((page) => page.records);

  it("has the same view before each page as all records give", () => {
    const view = emptyView();
    for (const page of pages) {
      expect(view).toEqual(viewOf(page.view));
      for (const record of page.records) apply(view, record);
    }
    expect(view.seq).toBe(head.records);
  });

  it("shows the same after any record, in any order", async () => {
    const reel = new Reel(head, async (number) => pages[number]!);
    const step = 11;
    for (let turn = 0; turn <= head.records; turn += 1) {
      const count = (turn * step) % (head.records + 1);
      const view = emptyView();
      for (const record of records.slice(0, count)) apply(view, record);
      await reel.read(reel.pageOf(count));
      expect(reel.after(count), `after ${count}`).toEqual(view);
    }
  });

  it("has the bars that a page makes of all records", () => {
    const spans = new Spans();
    for (const record of records) spans.add(record);
    const byId = (one: { id: string; from: number }, other: { id: string; from: number }) =>
      one.id.localeCompare(other.id) || one.from - other.from;
    const server = head.spans.map(({ count, ...span }) => {
      expect(count).toBe(1);
      return span;
    });
    expect(server.length).toBeGreaterThan(0);
    expect(server.sort(byId)).toEqual([...spans.all].sort(byId));
    expect([...head.rows].sort()).toEqual(spans.rows.sort());
  });
});
