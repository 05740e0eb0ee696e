import { expect, test } from "vitest";
import { newest, type Tone } from "./newestToasts";

const said = (text: string) => ({ text, tone: (text.startsWith("bad") ? "bad" : "good") as Tone });

test.each([
  ["all have room", ["a", "b"], 3, ["a", "b"]],
  ["the oldest goes", ["a", "b", "c", "d"], 3, ["b", "c", "d"]],
  ["what is bad stays", ["bad", "b", "c", "d"], 3, ["bad", "c", "d"]],
  ["only what is bad has room", ["bad 1", "b", "bad 2"], 2, ["bad 1", "bad 2"]],
  ["the newest of what is bad", ["bad 1", "bad 2", "c"], 1, ["bad 2"]],
])("%s", (_, texts, most, kept) => {
  expect(newest(texts.map(said), most).map(({ text }) => text)).toEqual(kept);
});
