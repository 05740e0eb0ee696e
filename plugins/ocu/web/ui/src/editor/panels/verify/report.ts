// The report of a verification: docs/verification.schema.json.
export type Verdict = "holds" | "violated" | "undecided";

export interface Tokens {
  element: string;
  count: number;
  waits: boolean;
}

export interface Step {
  step: number;
  text: string;
  element: string;
  passes: string[];
  trigger: string | null;
  detail: string;
  tokens: Tokens[];
  data: Record<string, unknown>;
  writes: Record<string, unknown>;
}

export interface Violation {
  property: string;
  warning: boolean;
  required: boolean;
  text: string;
  elements: string[];
  missing: string[];
  steps: Step[];
  loop: Step[];
  tokens: Tokens[];
}

export interface Answer {
  property: string;
  says: string;
  verdict: Verdict;
  warning: boolean;
  note: string;
  required: boolean;
  author: string;
  /** What the verdict assumes; "": nothing. */
  assumed: string;
  /** The same with the answer where nothing is assumed, for people; "": nothing to say. */
  condition: string;
  without: { verdict: Verdict; note: string; violation: Violation | null } | null;
}

export interface Report {
  mission: string;
  process: string;
  data: Record<string, unknown>;
  verdict: Verdict;
  strict: boolean;
  /** What the whole check assumes. */
  assumed: string;
  coverage: {
    states: number;
    transitions: number;
    seconds: number;
    stopped: string | null;
    notes: string[];
  };
  properties: Answer[];
  violations: Violation[];
  unreached: string[];
  approximations: { element: string; exactness: "more" | "bounded"; what: string }[];
}

/** How an answer is shown: a violation that is only a warning is not as bad. */
export type Outcome = "holds" | "violated" | "warning" | "undecided";

export function outcomeOf({ verdict, warning }: Answer, strict: boolean): Outcome {
  return verdict === "violated" && warning && !strict ? "warning" : verdict;
}

const ORDER: readonly Outcome[] = ["violated", "warning", "undecided", "holds"];

export interface Told {
  answer: Answer;
  outcome: Outcome;
  violations: Violation[];
}

/** What was asked, with what was found: the worst first, else in the report's order. */
export function tell(report: Report, required: boolean): Told[] {
  return report.properties
    .filter((answer) => answer.required === required)
    .map((answer) => ({
      answer,
      outcome: outcomeOf(answer, report.strict),
      violations: report.violations.filter(
        (each) => each.property === answer.property && each.required === required,
      ),
    }))
    .sort((one, other) => ORDER.indexOf(one.outcome) - ORDER.indexOf(other.outcome));
}

/** Answers by outcome. */
export function counted(report: Report): Record<Outcome, number> {
  const counts = { holds: 0, violated: 0, warning: 0, undecided: 0 };
  for (const answer of report.properties) counts[outcomeOf(answer, report.strict)] += 1;
  return counts;
}

/** What a mission means, without how it is drawn: moving a block makes no report stale. */
export function meaningOf(xml: string): string {
  return xml.replace(/<((?:[\w-]+:)?BPMNDiagram)\b[\s\S]*?<\/\1>/g, "");
}
