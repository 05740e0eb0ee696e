import { describe, expect, it } from "vitest";
import { ApiError } from "../../shared/api";
import { Job, type JobTold } from "./job";

type Reply = JobTold | Error;

function world(replies: Reply[]) {
  const asked: string[] = [];
  const requests = {
    get: async <T>(path: string) => {
      asked.push(`get ${path}`);
      const reply = replies.shift();
      if (!reply) throw new Error("asked too often");
      if (reply instanceof Error) throw reply;
      return reply as T;
    },
    post: async <T>(path: string, body: unknown) => {
      asked.push(`post ${path} ${JSON.stringify(body)}`);
      return { id: "v 1" } as T;
    },
    remove: async <T>(path: string) => {
      asked.push(`delete ${path}`);
      return undefined as T;
    },
  };
  return { asked, job: new Job<JobTold>("/verifications", requests, async () => {}) };
}

const refusal = new ApiError({ type: "about:blank", title: "Gone", status: 404, detail: "no such" });

describe("a job", () => {
  it("is asked after until it is over", async () => {
    const { asked, job } = world([{ state: "running" }, { state: "running" }, { state: "done" }]);
    const told = await job.run(async () => ({ xml: "x" }));
    expect(told).toEqual({ state: "done" });
    expect(asked).toEqual([
      'post /verifications {"xml":"x"}',
      ...Array<string>(3).fill("get /verifications/v%201"),
    ]);
    expect(job.isBusy.value).toBe(false);
  });

  it("begins once, however often it is asked to", async () => {
    const { asked, job } = world([{ state: "done" }]);
    const body = async () => ({});
    const [first, second] = await Promise.all([job.run(body), job.run(body)]);
    expect([first, second]).toEqual([{ state: "done" }, null]);
    expect(asked.filter((each) => each.startsWith("post"))).toHaveLength(1);
  });

  it("outlives answers that get lost, but no refusal", async () => {
    const lost = world([{ state: "running" }, new TypeError("network"), { state: "done" }]);
    expect(await lost.job.run(async () => ({}))).toEqual({ state: "done" });
    const gone = world([{ state: "running" }, refusal]);
    await gone.job.run(async () => ({}));
    expect(gone.job.refused.value?.detail).toBe("no such");
    expect(gone.job.isBusy.value).toBe(false);
  });

  it("can be cancelled", async () => {
    const { asked, job } = world([{ state: "running" }, { state: "cancelled" }]);
    const running = job.run(async () => ({}));
    while (job.phase.value !== "running") await Promise.resolve();
    await job.cancel();
    expect(await running).toEqual({ state: "cancelled" });
    expect(asked).toContain("delete /verifications/v%201");
  });

  it("says why it could not begin", async () => {
    const { job } = world([]);
    await job.run(() => Promise.reject(new Error("the mission could not be written")));
    expect(job.refused.value?.detail).toBe("the mission could not be written");
  });
});
