import { describe, expect, it } from "vitest";
import type { FragmentKind, Options } from "./fragments";
import { intentsOf } from "./intents";

const FIRST: [phrase: string, kind: FragmentKind, options?: Options][] = [
  ["at the same time", "same"],
  ["in parallel", "same"],
  ["parallel", "same"],
  ["both", "same"],
  ["simultaneously", "same"],
  ["meanwhile", "same"],
  ["concurrent", "same"],
  ["side by side", "same"],
  ["at the same", "same"],
  ["wait", "wait"],
  ["pause", "wait"],
  ["delay", "wait"],
  ["sleep", "wait"],
  ["in 5 minutes", "wait", { duration: "PT5M" }],
  ["wait 30 s", "wait", { duration: "PT30S" }],
  ["after 1 h 30 min", "wait", { duration: "PT1H30M" }],
  ["wait for 10 min", "wait", { duration: "PT10M" }],
  ["2 min", "wait", { duration: "PT2M" }],
  ["5 minutes later", "wait", { duration: "PT5M" }],
  ["at noon", "until"],
  ["tomorrow", "until"],
  ["wait until a time", "until"],
  ["as soon as", "ready"],
  ["wait for a condition", "ready"],
  ["wait for a signal", "signal"],
  ["wait for an operator", "signal"],
  ["wait for a message", "signal"],
  ["interrupt", "stopSignal"],
  ["cancel", "stopSignal"],
  ["call it off", "stopSignal"],
  ["if", "if"],
  ["otherwise", "if"],
  ["only when", "if"],
  ["depending on", "if"],
  ["branch", "if"],
  ["repeat", "repeat"],
  ["loop", "repeat"],
  ["3 times", "repeat", { count: 3 }],
  ["repeat 5 times", "repeat", { count: 5 }],
  ["twice", "repeat", { count: 2 }],
  ["again and again", "repeat"],
  ["every", "every"],
  ["every 10 s", "every", { duration: "PT10S" }],
  ["every 5 minutes", "every", { duration: "PT5M" }],
  ["periodically", "every"],
  ["stop when", "detected"],
  ["detect", "detected"],
  ["when something is detected", "detected"],
  ["when something is found, stop", "detected"],
  ["until detected", "detected"],
  ["watch for", "detected"],
  ["ask the operator", "ask"],
  ["ask", "ask"],
  ["question", "ask"],
  ["let the operator decide", "ask"],
  ["confirm", "ask"],
  ["if it fails", "fails"],
  ["on error", "fails"],
  ["fallback", "fails"],
  ["when it fails", "fails"],
  ["retry", "retry"],
  ["try again", "retry"],
  ["timeout", "within"],
  ["time limit", "within"],
  ["within 2 min", "within", { duration: "PT2M" }],
  ["timeout 90 s", "within", { duration: "PT90S" }],
  ["at most 1 hour", "within", { duration: "PT1H" }],
  ["takes too long", "within"],
  ["call another mission", "call"],
  ["submission", "call"],
];

describe("what people search for", () => {
  it.each(FIRST)("%s", (phrase, kind, options = {}) => {
    expect(intentsOf(phrase)[0]).toEqual({ kind, options });
  });

  it.each(["", "o", "orbit", "route", "single vehicle", "terminate end event", "takeoff", "uav1"])(
    "is a plain search: %s",
    (phrase) => expect(intentsOf(phrase)).toEqual([]),
  );

  it("offers what else may be meant after the first", () => {
    expect(intentsOf("stop when").map(({ kind }) => kind)).toContain("stopSignal");
  });
});
