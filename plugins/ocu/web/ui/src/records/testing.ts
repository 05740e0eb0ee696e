// A run in records, for tests: two tasks one after the other, a question, a behavior and a service.
import type { ElementState, LogKind, RecordChanges, RunRecord } from "../shared/types";

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

const state = (fields: Partial<ElementState>): ElementState => ({
  active: 0,
  hits: 1,
  last: 0,
  failed: false,
  asking: false,
  waiting: false,
  ...fields,
});

const PROMPT = {
  ...{ run: "r1", prompt: "p1", process: "P", element: "Ask", text: "Go?", role: "" },
  decisions: [{ value: "y", label: "" }],
};

const COMMAND = { name: "go", resources: ["v1"], process: "P", element: "Drive", since: 4 };

/** What the server sends with the records, by `seq`. */
const CHANGES: Record<number, RecordChanges> = {
  1: { status: "running" },
  2: { elements: { P: { Ask: state({ active: 1 }) } } },
  3: { elements: { P: { Ask: state({ active: 1, asking: true }) } }, prompts: { p1: PROMPT } },
  4: { elements: { P: { Ask: state({ active: 1, last: 4 }) } }, prompts: { p1: null } },
  5: { elements: { P: { Ask: state({ last: 4 }) } } },
  6: { elements: { P: { Drive: state({ active: 1, last: 4 }) } } },
  7: { commands: { "r1.b1": COMMAND } },
  9: { status: "paused" },
  10: { status: "running" },
  11: { commands: { "r1.b1": null } },
  12: { elements: { P: { Drive: state({ last: 9, failed: true }) } } },
  14: { status: "failed", detail: "nobody caught BLOCKED" },
};

const KINDS: Record<string, LogKind> = {
  Run: "run",
  Token: "tokens",
  Prompt: "prompts",
  Behavior: "behaviors",
  Service: "behaviors",
};

const URGENT = ["PromptOpened", "RunPaused", "BehaviorEnded", "TokenLeft", "RunEnded"];

const kindOf = (record: string): LogKind =>
  KINDS[record.replace(/([a-z])[A-Z].*/, "$1")] ?? "tokens";

export const RECORDS: RunRecord[] = FACTS.map(([t, record, fields], index) => ({
  run: "r1",
  seq: index + 1,
  t,
  record,
  sentence: [record, "by" in fields ? fields.by : ""].join(" ").trim(),
  kind: kindOf(record),
  urgent: URGENT.includes(record) && !("outcome" in fields && fields.outcome === "completed"),
  ...(CHANGES[index + 1] && { changes: CHANGES[index + 1] }),
  ...fields,
}));

/** One task that is entered and left for ever: four records a second. */
export function loop(count: number): RunRecord[] {
  return Array.from({ length: count }, (_, index) => ({
    run: "r1",
    seq: index + 1,
    t: index / 4,
    record: index % 2 === 0 ? "TokenEntered" : "TokenLeft",
    sentence: "",
    kind: "tokens",
    urgent: false,
    changes: {
      elements: { P: { [`T${(index >> 1) % 7}`]: state({ active: 1 - (index % 2), last: index / 4 }) } },
    },
    ...at(`T${(index >> 1) % 7}`),
    ...(index % 2 === 0 ? {} : { outcome: "completed" }),
  }));
}
