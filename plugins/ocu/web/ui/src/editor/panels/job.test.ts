import { describe, expect, it } from "vitest";
import { ApiError } from "../../shared/api";
import type { Finding } from "../../shared/types";
import { Job, type JobTold } from "./job";

type Reply = JobTold | Error;

const told = (state: JobTold["state"]): JobTold => ({ state, problem: null, findings: [] });

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

const refusal = new ApiError({
  type: "about:blank",
  title: "Gone",
  status: 404,
  detail: "no such",
});

describe("a job", () => {
  it("is asked after until it is over", async () => {
    const { asked, job } = world([told("running"), told("running"), told("done")]);
    expect(await job.run(async () => ({ xml: "x" }))).toEqual(told("done"));
    expect(asked).toEqual([
      'post /verifications {"xml":"x"}',
      ...Array<string>(3).fill("get /verifications/v%201"),
    ]);
    expect(job.isBusy.value).toBe(false);
  });

  it("begins once, however often it is asked to", async () => {
    const { asked, job } = world([told("done")]);
    const body = async () => ({});
    const [first, second] = await Promise.all([job.run(body), job.run(body)]);
    expect([first, second]).toEqual([told("done"), null]);
    expect(asked.filter((each) => each.startsWith("post"))).toHaveLength(1);
  });

  it("outlives answers that get lost, but no refusal", async () => {
    const lost = world([told("running"), new TypeError("network"), told("done")]);
    expect(await lost.job.run(async () => ({}))).toEqual(told("done"));
    const gone = world([told("running"), refusal]);
    await gone.job.run(async () => ({}));
    expect(gone.job.refusal.value?.text).toBe("no such");
    expect(gone.job.isBusy.value).toBe(false);
  });

  it("says why there is no result", async () => {
    const finding = { element: "Drive", message: "is stuck" } as Finding;
    const failed = { state: "failed" as const, problem: "it cannot be used:", findings: [finding] };
    const { job } = world([failed]);
    await job.run(async () => ({}));
    expect(job.refusal.value).toEqual({ text: "it cannot be used:", findings: [finding] });
  });

  it("can be cancelled", async () => {
    const { asked, job } = world([told("running"), told("cancelled")]);
    const running = job.run(async () => ({}));
    while (job.phase.value !== "running") await Promise.resolve();
    await job.cancel();
    expect(await running).toEqual(told("cancelled"));
    expect(asked).toContain("delete /verifications/v%201");
  });

  it("says why it could not begin", async () => {
    const { job } = world([]);
    await job.run(() => Promise.reject(new Error("the mission could not be written")));
    expect(job.refusal.value?.text).toBe("the mission could not be written");
  });
});
