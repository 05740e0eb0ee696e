// What a violated requirement throws in the mission of a run, and whether it ever can.
import type { Requirement } from "../../moddle/requirements";
import { patternNamed } from "./patterns";

export const KINDS = ["error", "signal"] as const;
export type Kind = (typeof KINDS)[number];

/** `kind` "": nothing; null: what is written is neither an error nor a signal. */
export interface Thrown {
  kind: Kind | "" | null;
  /** The code of the error, or the id or name of the signal. */
  name: string;
}

export function thrownBy({ onViolation: text }: Requirement): Thrown {
  if (text === "") return { kind: "", name: "" };
  const [written, ...rest] = text.split(":");
  const kind = KINDS.find((each) => each === written) ?? null;
  return { kind, name: kind ? rest.join(":") : text };
}

export interface Signal {
  id: string;
  name: string;
}

/** The signal that is meant, as m2pem finds it: by id or name, and only one. */
export function signalMeant(name: string, signals: readonly Signal[]): Signal | undefined {
  const found = signals.filter((each) => name === each.id || name === each.name);
  return found.length === 1 ? found[0] : undefined;
}

/** Whether it is about single steps, for which runs are not monitored. */
export const needsSteps = ({ pattern }: Requirement): boolean =>
  patternNamed(pattern)?.steps ?? false;

export type Fault =
  | "neither"
  | "noCode"
  | "noSignals"
  | "noSignal"
  | "unknownSignal"
  | "unmonitored"
  | "steps";

/** Why a violation cannot throw what is written; undefined: it can, or nothing is. */
export function faultOf(requirement: Requirement, signals: readonly Signal[]): Fault | undefined {
  const { kind, name } = thrownBy(requirement);
  if (kind === "") return undefined;
  if (kind === null) return "neither";
  if (needsSteps(requirement)) return "steps";
  if (requirement.monitor === "false") return "unmonitored";
  if (kind === "error") return name === "" ? "noCode" : undefined;
  if (signals.length === 0) return "noSignals";
  if (name === "") return "noSignal";
  return signalMeant(name, signals) ? undefined : "unknownSignal";
}

const ATTRIBUTE = "onViolation: ";

/** Whether a finding of the check is about what a violation throws. */
export const isAboutThrown = ({ message }: { message: string }): boolean =>
  message.startsWith(ATTRIBUTE);
