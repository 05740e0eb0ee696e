import { describe, expect, it } from "vitest";
import {
  counted,
  meaningOf,
  tell,
  type Answer,
  type Report,
  type Step,
  type Violation,
} from "./report";
import { changedData, frameAt, walkOf } from "./walk";

const step = (number: number, passes: string[], more: Partial<Step> = {}): Step => ({
  step: number,
  text: `step ${number}`,
  element: passes[0] ?? "",
  passes,
  trigger: null,
  detail: "",
  tokens: [],
  data: {},
  writes: {},
  ...more,
});

const violation = (more: Partial<Violation>): Violation => ({
  property: "no-deadlock",
  warning: false,
  required: false,
  text: "a token is stuck",
  elements: [],
  missing: [],
  steps: [],
  loop: [],
  tokens: [],
  ...more,
});

describe("a run that breaks a property", () => {
  const stuck = violation({
    elements: ["Join"],
    missing: ["FlowB"],
    steps: [
      step(1, ["Start", "FlowA"], { tokens: [{ element: "Fork", count: 1, waits: false }] }),
      step(2, ["Fork", "Join"]),
    ],
    tokens: [{ element: "FlowA", count: 1, waits: true }],
  });

  it("shows what was passed, what is passed now, and where tokens are then", () => {
    const { classes, numbers, stuck: none } = frameAt(stuck, 0);
    expect(classes).toEqual({
      Start: "m2v-passed m2v-now",
      FlowA: "m2v-passed m2v-now",
      Fork: "m2v-token",
    });
    expect([...numbers]).toEqual([["Start", [{ step: 1, repeats: false, now: true }]]]);
    expect(none).toEqual([]);
  });

  it("shows at its end what is stuck, and the flow by which nothing comes", () => {
    for (const end of [1, -1, 99]) {
      const { classes, stuck: found } = frameAt(stuck, end);
      expect(classes).toEqual({
        Start: "m2v-passed",
        FlowA: "m2v-passed m2v-token m2v-waits",
        Fork: "m2v-passed m2v-now",
        Join: "m2v-passed m2v-now m2v-stuck",
        FlowB: "m2v-missing",
      });
      expect(found).toEqual(["Join"]);
    }
  });

  it("tells steps that repeat from those before them", () => {
    const endless = violation({ steps: [step(1, ["A"])], loop: [step(2, ["B"]), step(3, ["A"])] });
    const { classes, numbers } = frameAt(endless, 2);
    expect(classes.A).toBe("m2v-passed m2v-repeats m2v-now");
    expect(classes.B).toBe("m2v-passed m2v-repeats");
    expect(numbers.get("A")).toEqual([
      { step: 1, repeats: false, now: false },
      { step: 3, repeats: true, now: true },
    ]);
    expect(walkOf(endless).before).toBe(1);
  });

  it("can be seen without any step", () => {
    const { classes } = frameAt(violation({ elements: ["Task"] }), -1);
    expect(classes).toEqual({ Task: "m2v-stuck" });
  });

  it("says which data a step changed", () => {
    const walk = walkOf(
      violation({
        steps: [
          step(1, ["A"], { data: { asked: null, speed: 2 } }),
          step(2, ["B"], { data: { asked: "go", speed: 2 } }),
        ],
      }),
    );
    expect(changedData(walk, 0)).toEqual([["speed", 2]]);
    expect(changedData(walk, 1)).toEqual([["asked", "go"]]);
  });
});

describe("a report", () => {
  const answer = (property: string, more: Partial<Answer>): Answer => ({
    property,
    says: "",
    verdict: "holds",
    warning: false,
    note: "",
    required: false,
    author: "",
    assumed: "",
    condition: "",
    without: null,
    ...more,
  });
  const report = {
    strict: false,
    properties: [
      answer("a", {}),
      answer("b", { verdict: "violated", warning: true }),
      answer("c", { verdict: "undecided" }),
      answer("d", { verdict: "violated" }),
      answer("d", { verdict: "violated", required: true }),
    ],
    violations: [violation({ property: "d" }), violation({ property: "d", required: true })],
  } as unknown as Report;

  it("tells the worst first, and each violation with what was asked", () => {
    const told = tell(report, false);
    expect(told.map(({ answer: { property }, outcome }) => [property, outcome])).toEqual([
      ["d", "violated"],
      ["b", "warning"],
      ["c", "undecided"],
      ["a", "holds"],
    ]);
    expect(told[0]!.violations).toEqual([report.violations[0]]);
    expect(tell(report, true)[0]!.violations).toEqual([report.violations[1]]);
  });

  it("counts a warning as a violation only when it is strict", () => {
    expect(counted(report)).toEqual({ holds: 1, violated: 2, warning: 1, undecided: 1 });
    expect(counted({ ...report, strict: true }).violated).toBe(3);
  });

  it("is of what a mission means, not of how it is drawn", () => {
    const drawn = (x: number, name: string) =>
      `<process name="${name}"/><bpmndi:BPMNDiagram id="d"><x y="${x}"/></bpmndi:BPMNDiagram><end/>`;
    expect(meaningOf(drawn(1, "a"))).toBe(meaningOf(drawn(2, "a")));
    expect(meaningOf(drawn(1, "a"))).not.toBe(meaningOf(drawn(1, "b")));
  });
});
