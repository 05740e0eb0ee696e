import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import type { ReelPage } from "../../records/reel";
import { apply, emptyView } from "../../records/runView";
import { loop } from "../../records/testing";
import type { RunSummary } from "../../shared/types";
import { ReplayScene, type ReplayHead } from "./replayScene";

const PAGE = 100;
const RECORDS = loop(5000);

function pageOf(number: number): ReelPage {
  const view = emptyView();
  for (const record of RECORDS.slice(0, number * PAGE)) apply(view, record);
  const { prompts, commands, holders, requirements, ...fields } = structuredClone(view);
  return {
    view: { ...fields, prompts: {}, commands: {}, holders: {}, requirements: {} },
    records: RECORDS.slice(number * PAGE, (number + 1) * PAGE),
  };
}

function replay(page = async (number: number) => pageOf(number)) {
  const head: ReplayHead = {
    records: RECORDS.length,
    end: RECORDS.at(-1)!.t,
    page: PAGE,
    times: RECORDS.filter(({ seq }) => seq % PAGE === 0).map(({ t }) => t),
    rows: [],
    spans: [],
    thinned: true,
    notable: [], stops: [],
  };
  const spans = vi.fn(async () => []);
  const scene = new ReplayScene("r1", {} as RunSummary, head, { page, spans });
  return { scene, spans };
}

/** What reading in the background has begun is over. */
const settle = async (scene: ReplayScene) => {
  await scene.settled();
  await vi.advanceTimersByTimeAsync(1000);
};

describe("replay scene", () => {
  beforeEach(() => {
    vi.useFakeTimers();
    vi.stubGlobal("requestAnimationFrame", () => 1);
    vi.stubGlobal("cancelAnimationFrame", () => undefined);
  });
  afterEach(() => {
    vi.unstubAllGlobals();
    vi.useRealTimers();
  });

  it("shows the moment that was sought last, whichever page comes first", async () => {
    const waiting: (() => void)[] = [];
    const { scene } = replay(
      (number) => new Promise((done) => waiting.push(() => done(pageOf(number)))),
    );
    scene.seek(100);
    expect(scene.loading.value).toBe(true);
    scene.seek(1000);
    expect(scene.time.value).toBe(1000);
    while (scene.loading.value) {
      waiting.shift()?.();
      await Promise.resolve();
    }
    expect(scene.events.value).toBe(RECORDS.filter(({ t }) => t <= 1000).length);
    scene.dispose();
  });

  it("shows the run as it was after a record of any page", async () => {
    const { scene } = replay();
    scene.seek(0);
    scene.play();
    for (const count of [3 * PAGE + 5, 2]) {
      scene.seekRecord(count);
      await settle(scene);
      expect(scene.events.value).toBe(count);
      expect(scene.playing.value).toBe(false);
    }
    scene.dispose();
  });

  it("steps over the edges of pages, forward and back", async () => {
    const { scene } = replay();
    scene.seek(RECORDS[PAGE - 1]!.t);
    await settle(scene);
    expect(scene.events.value).toBe(PAGE);
    for (const [by, count] of [[1, PAGE + 1], [1, PAGE + 2], [-1, PAGE + 1], [-1, PAGE], [-1, PAGE - 1]] as const) {
      scene.step(by);
      await settle(scene);
      expect(scene.events.value).toBe(count);
      expect(scene.now()).toBe(RECORDS[count - 1]!.t);
    }
    scene.dispose();
  });

  it("has the newest records before the moment in its log, and older ones when asked", async () => {
    const { scene } = replay();
    scene.seek(RECORDS[1049]!.t);
    await settle(scene);
    const seqs = () => scene.log.value.records.map(({ seq }) => seq);
    expect([seqs()[0], seqs().at(-1), scene.log.value.more]).toEqual([901, 1050, true]);
    await scene.older();
    await settle(scene);
    expect([seqs()[0], seqs().at(-1)]).toEqual([701, 1050]);
    for (let turn = 0; turn < 12; turn += 1) await scene.older();
    expect(seqs()[0]).toBe(1);
    expect(scene.log.value).toMatchObject({ more: false, cut: false });
    scene.seek(Infinity);
    await settle(scene);
    for (let turn = 0; turn < 12; turn += 1) await scene.older();
    expect(scene.log.value).toMatchObject({ more: false, cut: true });
    expect(seqs().at(-1)).toBe(5000);
    scene.dispose();
  });

  it("says why a moment cannot be shown, and shows it when it can", async () => {
    let fails = true;
    const { scene } = replay(async (number) => {
      if (fails) throw new Error("no connection");
      return pageOf(number);
    });
    scene.seek(500);
    await settle(scene);
    expect(scene.problem.value).toBe("no connection");
    expect(scene.status.value).toBeNull();
    fails = false;
    scene.seek(500);
    await settle(scene);
    expect(scene.problem.value).toBe("");
    expect(scene.events.value).toBe(2001);
    scene.dispose();
  });

  it("asks for the bars of a window when that rests", async () => {
    const { scene, spans } = replay();
    for (const from_s of [100, 200, 300]) scene.lookAt({ from_s, to_s: from_s + 100 });
    await vi.advanceTimersByTimeAsync(1000);
    expect(spans.mock.calls).toEqual([[{ from_s: 250, to_s: 450 }]]);
    scene.lookAt(null);
    await vi.advanceTimersByTimeAsync(1000);
    expect(spans).toHaveBeenCalledTimes(1);
    scene.dispose();
  });
});
