// A run in records, for tests: two tasks one after the other, a question, a behavior and a service.
import type { RunRecord } from "../shared/types";

const at = (element: string, token = 1) => ({ token, process: "P", element, scope: 1 });

const FACTS: [number, string, object][] = [
  [0, "RunStarted", { process: "P", started_us: 1_000_000 }],
  [0, "TokenEntered", at("Ask")],
  [0, "PromptOpened", { ...at("Ask"), prompt: "p1", text: "Go?", decisions: [{ value: "y" }] }],
  [4, "PromptAnswered", { ...at("Ask"), prompt: "p1", decision: "y", by: "anna" }],
  [4, "TokenLeft", { ...at("Ask"), outcome: "completed" }],
  [4, "TokenEntered", at("Drive")],
  [4, "BehaviorRequested", { ...at("Drive"), behavior: "r1.b1", name: "go", resources: ["v1"] }],
  [4, "ServiceRequested", { ...at("Look", 2), service: "s1", name: "Detector" }],
  [5, "RunPaused", { at_us: 6_000_000, by: "anna" }],
  [5, "RunResumed", { at_us: 9_000_000, by: "anna" }],
  [9, "BehaviorEnded", { ...at("Drive"), behavior: "r1.b1", state: "FAILED", code: "BLOCKED" }],
  [9, "TokenLeft", { ...at("Drive"), outcome: "failed" }],
  [9, "ServiceWithdrawn", { service: "s1" }],
  [9, "RunEnded", { outcome: "failed", detail: "nobody caught BLOCKED" }],
];

export const RECORDS: RunRecord[] = FACTS.map(([t, record, fields], index) => ({
  run: "r1",
  seq: index + 1,
  t,
  record,
  ...fields,
}));

/** One task that is entered and left for ever: four records a second. */
export function loop(count: number): RunRecord[] {
  return Array.from({ length: count }, (_, index) => ({
    run: "r1",
    seq: index + 1,
    t: index / 4,
    record: index % 2 === 0 ? "TokenEntered" : "TokenLeft",
    ...at(`T${(index >> 1) % 7}`),
    ...(index % 2 === 0 ? {} : { outcome: "completed" }),
  }));
}
