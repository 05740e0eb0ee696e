// The plan of a revision as the server gives it, and what the dialog makes of it.
import type { Finding, Outlook } from "../shared/types";

export interface Effect {
  kind: string;
  element: string;
  token: number;
  text: string;
  resources: string[];
}

export interface Refusal {
  element: string;
  token: number;
  text: string;
  candidates: string[];
  labels: string[];
  resources: string[];
  can_end: boolean;
}

export interface Plan {
  plan: string;
  version: string;
  previous: string;
  possible: boolean;
  changes: string[];
  effects: Effect[];
  refusals: Refusal[];
  findings: Finding[];
  outlook: Outlook | null;
  approval: string;
  busy: string[];
}

/** A mission of the folder (`version` "": its newest one), a file that is not saved there, or a
    version that the run has had (`number`: its place in the list of them, from 1 on). */
export type NewVersion =
  | { kind: "mission"; mission: string; version: string }
  | { kind: "had"; version: string; number: number }
  | { kind: "file"; mission: string; file: string; xml: string };

/** Where the token on an element goes: by its id, a target of the new version; "": it ends. */
export type Moves = Readonly<Record<string, string>>;

/** The tokens of an element that need an operator's choice, as the first refusal has said. */
export interface Choice {
  element: string;
  targets: readonly { id: string; label: string }[];
  canEnd: boolean;
}

/** What people read of a version. */
export const shortOf = (version: string): string => version.slice(0, 12);

/** What concerns vehicles comes first; otherwise in the order of the plan. */
export function vehiclesFirst<T extends { resources: readonly string[] }>(all: readonly T[]): T[] {
  return [
    ...all.filter(({ resources }) => resources.length > 0),
    ...all.filter(({ resources }) => resources.length === 0),
  ];
}

/** The choices that were known, and those of the tokens that a plan refuses to leave where they are. */
export function choicesWith(known: readonly Choice[], plan: Plan): Choice[] {
  const found = new Map(known.map((each) => [each.element, each]));
  for (const { element, candidates, labels, can_end } of plan.refusals) {
    if (found.has(element) || (candidates.length === 0 && !can_end)) continue;
    const targets = candidates.map((id, at) => ({ id, label: labels[at] ?? id }));
    found.set(element, { element, targets, canEnd: can_end });
  }
  return [...found.values()];
}

export const needsConfirmation = (plan: Plan): boolean =>
  plan.outlook?.verdict === "cannot complete";
