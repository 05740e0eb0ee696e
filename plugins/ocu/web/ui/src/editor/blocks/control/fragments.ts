// The blocks for the course of a mission, each a piece of BPMN that is correct as it is.
import { fill, strings } from "../../../strings";
import { shownDuration } from "../../session/durations";
import type { TaskContent } from "../blocks";
import { HOST, type EventUse, type Fragment, type FragmentNode } from "./fragment";

const { names } = strings.control;

/** What a phrase may say about a block: "in 5 minutes", "3 times". */
export interface Options {
  /** ISO 8601. */
  duration?: string;
  count?: number;
}

export type FragmentKind =
  | "same"
  | "wait"
  | "until"
  | "ready"
  | "signal"
  | "stopSignal"
  | "if"
  | "repeat"
  | "every"
  | "detected"
  | "ask"
  | "fails"
  | "retry"
  | "within"
  | "call";

/** In the order in which they are offered. */
export const KINDS: readonly FragmentKind[] = [
  "same",
  "wait",
  "until",
  "ready",
  "if",
  "repeat",
  "every",
  "detected",
  "ask",
  "fails",
  "retry",
  "within",
  "signal",
  "stopSignal",
  "call",
];

/** Those that are put on an activity, at its border. */
export const ATTACHED: ReadonlySet<FragmentKind> = new Set(["fails", "within", "stopSignal"]);

const MINUTE = "PT1M";
const TEN_MINUTES = "PT10M";
const THRICE = 3;
const USUAL_SIZE = [100, 80] as const;

type At = FragmentNode["at"];

const task = (id: string, name: string, at: At, more: Partial<FragmentNode> = {}): FragmentNode => ({
  id,
  type: "bpmn:ScriptTask",
  name,
  at,
  ...more,
});

const gateway = (id: string, type: "Parallel" | "Exclusive", name: string, at: At): FragmentNode => ({
  id,
  type: `bpmn:${type}Gateway`,
  name,
  at,
});

function event(
  id: string,
  type: "Start" | "End" | "IntermediateCatch" | "Boundary",
  name: string,
  at: At,
  use?: EventUse,
): FragmentNode {
  return { id, type: `bpmn:${type}Event`, name, at, ...(use ? { event: use } : {}) };
}

const asked: TaskContent = { kind: "prompt" };

const USUAL_DETECTOR: TaskContent = {
  kind: "service",
  use: { name: "Detector", parameters: [], roles: [] },
};

const alone = (node: FragmentNode): Fragment => ({
  nodes: [node],
  flows: [],
  entry: node.id,
  exit: node.id,
});

const catching = (name: string, use: EventUse): Fragment =>
  alone(event("wait", "IntermediateCatch", name, [0, 0], use));

/** The piece of BPMN of a block. `detector`: the service task that watches. */
export function fragmentOf(
  kind: FragmentKind,
  options: Options = {},
  detector: TaskContent = USUAL_DETECTOR,
): Fragment {
  const { duration = MINUTE, count = THRICE } = options;
  switch (kind) {
    case "same":
      return atTheSameTime();
    case "wait":
      return catching(waitName(duration), { kind: "timer", after: duration });
    case "until": {
      const at = tomorrowMorning();
      return catching(fill(names.until, { date: at }), { kind: "date", at });
    }
    case "ready":
      return catching(names.ready, { kind: "condition", when: "mission.ready == true" });
    case "signal":
      return catching(names.signal, { kind: "signal", name: names.signal, fromOperators: true });
    case "if":
      return onlyIf();
    case "repeat":
      return repeated(count);
    case "every":
      return everySoOften(duration, count);
    case "detected":
      return untilDetected(detector);
    case "ask":
      return askAndDecide();
    case "retry":
      return tryAgain();
    case "call":
      return alone({ id: "call", type: "bpmn:CallActivity", name: names.call, at: [0, 0] });
    default:
      return withPlaceholder(kind, options);
  }
}

export const waitName = (duration: string): string =>
  fill(names.wait, { duration: shownDuration(duration) });

function tomorrowMorning(): string {
  const at = new Date(Date.now() + 24 * 3600 * 1000);
  at.setUTCHours(8, 0, 0, 0);
  return at.toISOString().replace(".000", "");
}

function atTheSameTime(): Fragment {
  return {
    nodes: [
      gateway("fork", "Parallel", names.fork, [0, 0]),
      task("one", names.first, [140, -60]),
      task("other", names.also, [140, 60]),
      gateway("join", "Parallel", names.join, [280, 0]),
    ],
    flows: [
      { from: "fork", to: "one" },
      { from: "fork", to: "other" },
      { from: "one", to: "join" },
      { from: "other", to: "join" },
    ],
    entry: "fork",
    exit: "join",
  };
}

function onlyIf(): Fragment {
  return {
    nodes: [
      gateway("split", "Exclusive", names.decide, [0, 0]),
      task("then", names.then, [140, -100]),
      gateway("merge", "Exclusive", "", [280, 0]),
    ],
    flows: [
      { from: "split", to: "then", name: names.yes, when: "user.decision == 'continue'" },
      { from: "split", to: "merge", name: names.no, isDefault: true },
      { from: "then", to: "merge" },
    ],
    entry: "split",
    exit: "merge",
  };
}

function repeated(count: number): Fragment {
  const inside = { in: "again" };
  return {
    nodes: [
      {
        id: "again",
        type: "bpmn:SubProcess",
        name: fill(names.repeat, { count }),
        at: [0, 0],
        size: [340, 150],
        times: count,
      },
      { ...event("begin", "Start", names.begin, [-125, 0]), ...inside },
      task("body", names.body, [0, 0], inside),
      { ...event("done", "End", names.done, [125, 0]), ...inside },
    ],
    flows: [
      { from: "begin", to: "body" },
      { from: "body", to: "done" },
    ],
    entry: "again",
    exit: "again",
  };
}

function everySoOften(duration: string, count: number): Fragment {
  const inside = { in: "again" };
  const wait: EventUse = { kind: "timer", after: duration };
  const shown = shownDuration(duration);
  return {
    nodes: [
      {
        id: "again",
        type: "bpmn:SubProcess",
        name: fill(names.every, { duration: shown, count }),
        at: [0, 0],
        size: [430, 150],
        times: count,
      },
      { ...event("begin", "Start", names.begin, [-170, 0]), ...inside },
      task("body", names.body, [-50, 0], inside),
      {
        ...event("wait", "IntermediateCatch", waitName(duration), [75, 0], wait),
        ...inside,
      },
      { ...event("done", "End", names.done, [165, 0]), ...inside },
    ],
    flows: [
      { from: "begin", to: "body" },
      { from: "body", to: "wait" },
      { from: "wait", to: "done" },
    ],
    entry: "again",
    exit: "again",
  };
}

function untilDetected(detector: TaskContent): Fragment {
  const inside = { in: "watch" };
  const escalation: EventUse = { kind: "escalation", name: names.detected };
  return {
    nodes: [
      { id: "watch", type: "bpmn:SubProcess", name: names.watch, at: [0, 0], size: [460, 270] },
      { ...event("begin", "Start", names.begin, [-185, 0]), ...inside },
      { ...gateway("both", "Parallel", names.both, [-105, 0]), ...inside },
      task("body", names.body, [20, -65], inside),
      { ...event("done", "End", names.done, [165, -65], { kind: "terminate" }), ...inside },
      {
        id: "detect",
        type: "bpmn:ServiceTask",
        name: names.detect,
        at: [20, 65],
        ...inside,
        content: detector,
      },
      { ...event("found", "End", names.detected, [165, 65], escalation), ...inside },
      { ...event("caught", "Boundary", names.detected, [120, 135], escalation), on: "watch" },
      task("then", names.then, [260, 225]),
      gateway("merge", "Exclusive", "", [345, 0]),
    ],
    flows: [
      { from: "begin", to: "both" },
      { from: "both", to: "body" },
      { from: "both", to: "detect" },
      { from: "body", to: "done" },
      { from: "detect", to: "found" },
      { from: "watch", to: "merge" },
      { from: "caught", to: "then" },
      { from: "then", to: "merge" },
    ],
    entry: "watch",
    exit: "merge",
  };
}

function askAndDecide(): Fragment {
  return {
    nodes: [
      { id: "ask", type: "bpmn:UserTask", name: names.ask, at: [0, 0], content: asked },
      gateway("answer", "Exclusive", names.answer, [130, 0]),
      task("then", names.then, [260, 0]),
      event("abort", "End", names.abort, [130, 120], { kind: "terminate" }),
    ],
    flows: [
      { from: "ask", to: "answer" },
      { from: "answer", to: "then", name: names.go, isDefault: true },
      { from: "answer", to: "abort", name: names.abort, when: "user.decision == 'abort'" },
    ],
    entry: "ask",
    exit: "then",
  };
}

function tryAgain(): Fragment {
  return {
    nodes: [
      gateway("again", "Exclusive", names.again, [0, 0]),
      task("body", names.body, [130, 0]),
      { ...event("failed", "Boundary", names.failed, [150, 40], { kind: "error" }), on: "body" },
      { id: "ask", type: "bpmn:UserTask", name: names.askAgain, at: [250, 150], content: asked },
      gateway("answer", "Exclusive", names.again, [250, 260]),
      event("giveUp", "End", names.giveUp, [360, 260], { kind: "terminate" }),
    ],
    flows: [
      { from: "again", to: "body" },
      { from: "failed", to: "ask" },
      { from: "ask", to: "answer" },
      {
        from: "answer",
        to: "again",
        name: names.tryAgain,
        isDefault: true,
        way: [
          [225, 260],
          [0, 260],
          [0, 25],
        ],
      },
      { from: "answer", to: "giveUp", name: names.giveUp, when: "user.decision == 'abort'" },
    ],
    entry: "again",
    exit: "body",
  };
}

/** What is put on an activity: it is interrupted, and something is done instead. The entry is where
 * both ways meet; places are seen from the centre of the activity. */
export function attachedOf(
  kind: FragmentKind,
  options: Options = {},
  [width, height]: readonly [number, number] = USUAL_SIZE,
): Fragment {
  const { duration = TEN_MINUTES } = options;
  const [right, low] = [width / 2, height / 2];
  const uses: Partial<Record<FragmentKind, [name: string, use: EventUse]>> = {
    fails: [names.failed, { kind: "error" }],
    within: [
      fill(names.late, { duration: shownDuration(duration) }),
      { kind: "timer", after: duration },
    ],
    stopSignal: [
      names.stopSignal,
      { kind: "signal", name: names.stopSignal, fromOperators: true },
    ],
  };
  const [name, use] = uses[kind] ?? uses.fails!;
  return {
    nodes: [
      { ...event("caught", "Boundary", name, [right - 30, low], use), on: HOST },
      task("instead", names.instead, [right + 60, low + 110]),
      gateway("merge", "Exclusive", "", [right + 150, 0]),
    ],
    flows: [
      { from: HOST, to: "merge" },
      { from: "caught", to: "instead" },
      { from: "instead", to: "merge" },
    ],
    entry: HOST,
    exit: "merge",
  };
}

/** The same, with an activity of its own that has still to be chosen. */
function withPlaceholder(kind: FragmentKind, options: Options): Fragment {
  const fragment = attachedOf(kind, options);
  return { ...fragment, nodes: [task(HOST, names.body, [0, 0]), ...fragment.nodes] };
}
