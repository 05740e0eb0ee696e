import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { Latest } from "./latest";

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

function asked() {
  const open: { question: string; answer(): void; fail(): void }[] = [];
  const said: string[] = [];
  const latest = new Latest<string, string>(
    (question) =>
      new Promise((answer, fail) =>
        open.push({
          question,
          answer: () => answer(`${question}!`),
          fail: () => fail(new Error(question)),
        }),
      ),
    { answer: (answer) => said.push(answer), failed: (error) => said.push(String(error)) },
    100,
  );
  return { open, said, latest };
}

test("only the newest question of a burst is asked", async () => {
  const { open, said, latest } = asked();
  for (const each of ["a", "b", "c"]) latest.soon(each);
  await vi.advanceTimersByTimeAsync(100);
  expect(open.map(({ question }) => question)).toEqual(["c"]);
  open[0]!.answer();
  await vi.advanceTimersByTimeAsync(0);
  expect(said).toEqual(["c!"]);
});

test("one is asked at a time, and an answer that is too late does not count", async () => {
  const { open, said, latest } = asked();
  latest.soon("a");
  await vi.advanceTimersByTimeAsync(100);
  latest.soon("b");
  await vi.advanceTimersByTimeAsync(100);
  latest.soon("c");
  await vi.advanceTimersByTimeAsync(100);
  expect(open.map(({ question }) => question)).toEqual(["a"]);
  open[0]!.answer();
  await vi.advanceTimersByTimeAsync(0);
  expect(open.map(({ question }) => question)).toEqual(["a", "c"]);
  expect(said).toEqual([]);
  open[1]!.fail();
  await vi.advanceTimersByTimeAsync(0);
  expect(said).toEqual(["Error: c"]);
});

test("nothing is said after it was cleared or has ended", async () => {
  const { open, said, latest } = asked();
  latest.soon("a");
  await vi.advanceTimersByTimeAsync(100);
  latest.clear();
  open[0]!.answer();
  await vi.advanceTimersByTimeAsync(0);
  latest.soon("b");
  latest.end();
  await vi.advanceTimersByTimeAsync(1000);
  expect(open).toHaveLength(1);
  expect(said).toEqual([]);
});
