import { describe, expect, it } from "vitest";
import { loop } from "../../records/testing";
import { RecordFeed } from "./recordFeed";

function journal(count: number) {
  const records = loop(count);
  const asked: number[] = [];
  const read = async (after: number, limit: number) => {
    asked.push(after);
    const page = records.slice(after, after + limit);
    return { records: page, next: page.length < limit ? null : page.at(-1)!.seq };
  };
  return { records, asked, read };
}

const settled = () => new Promise((resolve) => setTimeout(resolve, 5));
const seqs = (feed: RecordFeed) => feed.log.value.records.map(({ seq }) => seq);
const upTo = (from: number, to: number) =>
  Array.from({ length: to - from + 1 }, (_, i) => from + i);

describe("record feed", () => {
  it("reads all there is, then takes what is pushed", async () => {
    const { records, read } = journal(2503);
    const feed = new RecordFeed(read);
    await feed.begin(2500);
    feed.push(records.slice(2490, 2503));
    await settled();
    expect(seqs(feed)).toEqual(upTo(1, 2503));
    expect(feed.log.value).toMatchObject({ more: false, skipped: 0 });
  });

  it("keeps what is pushed while it reads", async () => {
    const { records, read } = journal(1500);
    const feed = new RecordFeed(read);
    const begun = feed.begin(1200);
    feed.push(records.slice(1200, 1500));
    await begun;
    await settled();
    expect(seqs(feed)).toEqual(upTo(1, 1500));
  });

  it("reads what is missing before what was pushed", async () => {
    const { records, read } = journal(900);
    const feed = new RecordFeed(read);
    await feed.begin(100);
    feed.push(records.slice(700, 900));
    await settled();
    expect(seqs(feed)).toEqual(upTo(1, 900));
  });

  it("leaves out and counts what is too much to follow", async () => {
    const { records, read } = journal(9000);
    const feed = new RecordFeed(read);
    await feed.begin(100);
    feed.push(records.slice(8800, 9000));
    await settled();
    expect(feed.log.value.skipped).toBeGreaterThan(7000);
    expect(seqs(feed).at(-1)).toBe(9000);
  });

  it("begins late in a very long run, and reads older ones when asked", async () => {
    const { read } = journal(30_000);
    const feed = new RecordFeed(read);
    await feed.begin(30_000);
    expect(feed.log.value.more).toBe(true);
    const first = seqs(feed)[0]!;
    await feed.older();
    expect(seqs(feed)).toEqual(upTo(first - 500, 30_000));
  });
});
