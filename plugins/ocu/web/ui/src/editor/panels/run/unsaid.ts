// What a rehearsal took for granted where its script says nothing, and which property of a
// verification shows why it failed.
import type { RunRecord, RunSummary } from "../../../shared/types";

/** Who answers a prompt, or ends the run at an incident, that nothing is scripted for. */
const BY_DEFAULT = "default";

export interface UnsaidAnswer {
  element: string;
  decision: string;
  times: number;
}

export class Unsaid {
  readonly answers: UnsaidAnswer[] = [];
  /** Behaviors that were begun. */
  behaviors = 0;
  /** Elements of services that were begun. */
  services = 0;

  add(record: RunRecord): void {
    if (record.record === "BehaviorRequested") this.behaviors += 1;
    if (record.record === "ServiceRequested") this.services += 1;
    if (record.record !== "PromptAnswered" || record.by !== BY_DEFAULT) return;
    const element = record.element ?? "";
    const decision = String(record.decision ?? "");
    const known = this.answers.find((each) => each.element === element && each.decision === decision);
    if (known) known.times += 1;
    else this.answers.push({ element, decision, times: 1 });
  }
}

/** Why a run failed, as far as a property of a verification is about that. */
export interface Cause {
  property: string;
  /** Where; "" where no element is named. */
  element: string;
  reason: "uncaught" | "sameVehicle" | "noFlow" | "stuck" | "thrown";
}

const UNCAUGHT = /^error (\S+) from (\S+?), which no event catches/;
const STUCK = /^nothing that is scheduled can happen any more/;
const AWAITED = /awaited: .*?\(?([\p{L}_][\p{L}\p{N}_.-]*)\)?(?:, |$)/u;

/** Codes of errors of the work itself; others the model throws. */
const OF_WORK = new Set(["FAILED", "REJECTED", "TIMEOUT", "LINK_LOST", "BATTERY_LOW", "ROUTE_BLOCKED"]);

export function causeOf({ status, detail }: Pick<RunSummary, "status" | "detail">): Cause | undefined {
  if (status !== "failed") return undefined;
  const [, code = "", element = ""] = UNCAUGHT.exec(detail) ?? [];
  if (code === "RESOURCE_UNAVAILABLE") return { property: "one-behavior", element, reason: "sameVehicle" };
  if (code === "NO_FLOW") return { property: "decisions-handled", element, reason: "noFlow" };
  if (OF_WORK.has(code)) return { property: "failures-handled", element, reason: "uncaught" };
  if (code) return { property: "errors-caught", element, reason: "thrown" };
  if (!STUCK.test(detail)) return undefined;
  const [, awaited = ""] = AWAITED.exec(detail) ?? [];
  return { property: "no-deadlock", element: awaited, reason: "stuck" };
}
