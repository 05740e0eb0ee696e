import { describe, expect, it } from "vitest";
import { isUrgent, kindOf, lineOf, type Names } from "./story";
import { RECORDS } from "./testing";

const names: Names = {
  element: (_, element) => element.toUpperCase(),
  definition: (id) => (id === "6f1c" ? "Stop driving" : id),
};
const line = (index: number) => lineOf(RECORDS[index]!, names);

describe("story", () => {
  it("says what happened, with the names of the diagram", () => {
    expect(line(2).text).toBe("ASK asks: Go?");
    expect(line(3).text).toBe("ASK: anna decided “y”");
    expect(line(6).text).toBe("DRIVE: go · v1");
    expect(line(10).text).toBe("DRIVE: r1.b1 failed BLOCKED");
  });

  it("calls signals by their name", () => {
    const thrown = { run: "r1", seq: 1, t: 0, record: "SignalThrown", signal: "6f1c", by: "anna" };
    expect(lineOf(thrown, names).text).toBe("Signal Stop driving by anna");
  });

  it("leaves out what has nothing to say", () => {
    const ended = { run: "r1", seq: 1, t: 0, record: "RunEnded", outcome: "completed" };
    expect(lineOf(ended, names).text).toBe("Run completed");
  });

  it("shows records that it does not know", () => {
    const unknown = { run: "r1", seq: 1, t: 0, record: "SomethingNew", element: "x" };
    expect(lineOf(unknown, names)).toMatchObject({ text: "SomethingNew · X", kind: "tokens" });
  });

  it("knows what is urgent", () => {
    const urgent = RECORDS.filter(isUrgent).map(({ record }) => record);
    expect(urgent).toEqual(["PromptOpened", "RunPaused", "BehaviorEnded", "TokenLeft", "RunEnded"]);
  });

  it("sorts records into kinds", () => {
    expect(kindOf("BehaviorProgressed")).toBe("behaviors");
    expect(kindOf("SignalThrown")).toBe("events");
    expect(kindOf("GeometryReceived")).toBe("operators");
    expect(kindOf("FlowTaken")).toBe("tokens");
  });
});
