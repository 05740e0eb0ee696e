// A run after a number of its records. The server applies the records; here only the changes that
// come with each record are merged, so that a replay shows the same as a live run.
import type {
  Command,
  Debugging,
  Elements,
  ElementState,
  Prompt,
  Requirement,
  RunRecord,
  RunStatus,
} from "../shared/types";

/** `apply` changes it in place, `copy` keeps a moment of it. */
export interface RunView {
  seq: number;
  t: number;
  status: RunStatus;
  detail: string;
  elements: Elements;
  prompts: Map<string, Prompt>;
  commands: Map<string, Command>;
  holders: Map<string, string>;
  requirements: Map<string, Requirement>;
  debugging: Debugging | null;
}

/** A view as the server sends it. */
export interface PageView {
  seq: number;
  t: number;
  status: RunStatus;
  detail: string;
  elements: Elements;
  prompts: Record<string, Prompt>;
  commands: Record<string, Command>;
  holders: Record<string, string>;
  requirements: Record<string, Requirement>;
  debugging: Debugging | null;
}

export const viewOf = ({
  prompts,
  commands,
  holders,
  requirements,
  ...view
}: PageView): RunView => ({
  ...view,
  prompts: new Map(Object.entries(prompts)),
  commands: new Map(Object.entries(commands)),
  holders: new Map(Object.entries(holders)),
  requirements: new Map(Object.entries(requirements)),
});

export function emptyView(): RunView {
  return {
    seq: 0,
    t: 0,
    status: "running",
    detail: "",
    elements: {},
    prompts: new Map(),
    commands: new Map(),
    holders: new Map(),
    requirements: new Map(),
    debugging: null,
  };
}

export function copy(view: RunView): RunView {
  const elements: Elements = {};
  for (const [process, states] of Object.entries(view.elements)) {
    const copied: Record<string, ElementState> = {};
    for (const [element, state] of Object.entries(states)) copied[element] = { ...state };
    elements[process] = copied;
  }
  return {
    ...view,
    elements,
    prompts: new Map(view.prompts),
    commands: new Map(view.commands),
    holders: new Map(view.holders),
    requirements: new Map(view.requirements),
  };
}

/** Merge what the next record changes. One that was applied already changes nothing. */
export function apply(view: RunView, record: RunRecord): void {
  if (record.seq <= view.seq) return;
  view.seq = record.seq;
  view.t = record.t;
  const { changes } = record;
  if (!changes) return;
  for (const [process, states] of Object.entries(changes.elements ?? {})) {
    Object.assign((view.elements[process] ??= {}), states);
  }
  merge(view.commands, changes.commands);
  merge(view.prompts, changes.prompts);
  merge(view.holders, changes.holders);
  merge(view.requirements, changes.requirements);
  if (changes.debugging !== undefined) view.debugging = changes.debugging;
  view.status = changes.status ?? view.status;
  view.detail = changes.detail ?? view.detail;
}

function merge<T>(into: Map<string, T>, changes: Record<string, T | null> = {}): void {
  for (const [key, value] of Object.entries(changes)) {
    if (value === null) into.delete(key);
    else into.set(key, value);
  }
}
