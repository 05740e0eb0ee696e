import { describe, expect, it } from "vitest";
import type { LogKind } from "../../records/logLine";
import { RECORDS } from "../../records/testing";
import { Lines } from "./filter";

const lines = new Lines();
const all = { words: "", hidden: new Set<LogKind>(), urgentOnly: false };
const names = (wanted: object, most = 1000) =>
  lines.wanted(RECORDS, { ...all, ...wanted }, most).map(({ record }) => record);

describe("log filter", () => {
  it("shows all, or the newest of them", () => {
    expect(names({})).toHaveLength(RECORDS.length);
    expect(names({}, 2)).toEqual(["ServiceWithdrawn", "RunEnded"]);
  });

  it("looks for words in what is said, and in the record's name", () => {
    expect(names({ words: "anna" })).toEqual(["PromptAnswered", "RunPaused", "RunResumed"]);
    expect(names({ words: "servicewith" })).toEqual(["ServiceWithdrawn"]);
  });

  it("shows what is urgent though its kind is hidden", () => {
    const kinds = new Set<LogKind>(["tokens", "run", "prompts", "behaviors"]);
    expect(names({ hidden: kinds })).toEqual([
      "PromptOpened",
      "RunPaused",
      "BehaviorEnded",
      "TokenLeft",
      "RunEnded",
    ]);
  });
});
