import { describe, expect, it } from "vitest";
import type { RunRecord } from "../../../shared/types";
import { causeOf, Unsaid } from "./unsaid";

const record = (more: object) => more as RunRecord;

describe("what a script does not say", () => {
  it("is which answers were the first that there are, and how often", () => {
    const unsaid = new Unsaid();
    const answered = { record: "PromptAnswered", element: "Ask", decision: "continue" };
    unsaid.add(record({ ...answered, by: "default" }));
    unsaid.add(record({ ...answered, by: "default" }));
    unsaid.add(record({ ...answered, by: "answers file" }));
    unsaid.add(record({ record: "BehaviorRequested" }));
    expect(unsaid.answers).toEqual([{ element: "Ask", decision: "continue", times: 2 }]);
    expect([unsaid.behaviors, unsaid.services]).toEqual([1, 0]);
  });
});

describe("why a rehearsal failed", () => {
  it.each([
    ["error FAILED from Drive, which no event catches: stuck", "failures-handled", "Drive"],
    ["error RESOURCE_UNAVAILABLE from Survey, which no event catches", "one-behavior", "Survey"],
    ["error NO_FLOW from Decision, which no event catches", "decisions-handled", "Decision"],
    ["error NO_FUEL from Check, which no event catches", "errors-caught", "Check"],
    [
      "nothing that is scheduled can happen any more; awaited: Detector (Detector)",
      "no-deadlock",
      "Detector",
    ],
    ["nothing that is scheduled can happen any more", "no-deadlock", ""],
  ])("%s", (detail, property, element) => {
    expect(causeOf({ status: "failed", detail })).toMatchObject({ property, element });
  });

  it("is nothing where it did not, or no property is about that", () => {
    expect(causeOf({ status: "completed", detail: "" })).toBeUndefined();
    expect(causeOf({ status: "failed", detail: "it has taken the steps" })).toBeUndefined();
  });
});
