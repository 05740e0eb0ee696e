// The patterns of requirements (docs/requirements.md), as m2pem has them.
import patterns from "./patterns.json";

export type Kind =
  | "condition"
  | "conditions"
  | "element"
  | "elements"
  | "resource"
  | "behavior"
  | "count"
  | "flag"
  | "decision"
  | "duration";

export interface Argument {
  name: string;
  kind: Kind;
  required: boolean;
}

export interface Pattern {
  name: string;
  group: string;
  meaning: string;
  /** Whether it may be asked for a part of the run only. */
  scoped: boolean;
  /** Whether only fair runs count, unless it says otherwise. */
  fair: boolean;
  /** Whether it is about single steps of a run. */
  steps: boolean;
  arguments: Argument[];
}

export const PATTERNS: readonly Pattern[] = patterns as Pattern[];

export function patternNamed(name: string): Pattern | undefined {
  return PATTERNS.find((each) => each.name === name);
}

/** Which part of the run is meant; each a condition that may be absent. */
export const SCOPES = ["after", "before", "until"] as const;

export function scopesOf(pattern: Pattern): Argument[] {
  if (!pattern.scoped) return [];
  const own = new Set(pattern.arguments.map(({ name }) => name));
  const free = SCOPES.filter((name) => !own.has(name));
  return free.map((name) => ({ name, kind: "condition", required: false }));
}

export const isList = (kind: Kind): boolean => kind === "conditions" || kind === "elements";

/** "each_location" as people write it. */
export const spaced = (name: string): string => name.replaceAll("_", " ");
