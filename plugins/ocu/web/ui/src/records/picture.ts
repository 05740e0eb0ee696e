// How a run stands after a number of its records: the same states as the server tells of a live
// run.
import type {
  Command,
  Elements,
  ElementState,
  Prompt,
  RunRecord,
  RunStatus,
} from "../shared/types";

interface Token {
  process: string;
  element: string;
}

/**
 * Made of records only, in their order; `fold` changes it in place, `copy` keeps a moment of it.
 */
export interface Picture {
  seq: number;
  t: number;
  status: RunStatus;
  detail: string;
  elements: Elements;
  prompts: Map<string, Prompt>;
  commands: Map<string, Command>;
  holders: Map<string, string>;
  tokens: Map<number, Token>;
  /** Tokens that wait on an activity around its instances; they are none of them. */
  around: Set<number>;
}

export function emptyPicture(): Picture {
  return {
    seq: 0,
    t: 0,
    status: "running",
    detail: "",
    elements: {},
    prompts: new Map(),
    commands: new Map(),
    holders: new Map(),
    tokens: new Map(),
    around: new Set(),
  };
}

export function copy(picture: Picture): Picture {
  const elements: Elements = {};
  for (const [process, states] of Object.entries(picture.elements)) {
    const copied: Record<string, ElementState> = {};
    for (const [element, state] of Object.entries(states)) copied[element] = { ...state };
    elements[process] = copied;
  }
  return {
    ...picture,
    elements,
    prompts: new Map(picture.prompts),
    commands: new Map(picture.commands),
    holders: new Map(picture.holders),
    tokens: new Map(picture.tokens),
    around: new Set(picture.around),
  };
}

/** Take one record in. One that is in already changes nothing. */
export function fold(picture: Picture, record: RunRecord): void {
  if (record.seq <= picture.seq) return;
  picture.seq = record.seq;
  picture.t = record.t;
  const change = CHANGES[record.record];
  if (change) change(picture, record);
}

const CHANGES: Record<string, (picture: Picture, record: RunRecord) => void> = {
  RunStarted: (picture) => {
    picture.status = "running";
  },
  RunPaused: (picture) => {
    picture.status = "paused";
  },
  RunResumed: (picture) => {
    picture.status = "running";
  },
  RunEnded: (picture, record) => {
    picture.status = text(record, "outcome") as RunStatus;
    picture.detail = text(record, "detail");
    for (const token of [...picture.tokens.keys()]) leave(picture, token, record.t, "terminated");
    for (const prompt of [...picture.prompts.keys()]) closePrompt(picture, prompt, record.t);
  },
  TokenEntered: (picture, record) => enter(picture, record),
  TokenLeft: (picture, record) =>
    leave(picture, record.token ?? 0, record.t, text(record, "outcome")),
  ScopeOpened: (picture, record) => surround(picture, record),
  BehaviorRequested: (picture, record) => {
    picture.commands.set(text(record, "behavior"), {
      name: text(record, "name"),
      resources: (record.resources as string[] | undefined) ?? [],
      process: record.process ?? "",
      element: record.element ?? "",
      since: record.t,
    });
  },
  BehaviorEnded: (picture, record) => {
    picture.commands.delete(text(record, "behavior"));
  },
  PromptOpened: (picture, record) => {
    const prompt = promptOf(record);
    picture.prompts.set(prompt.prompt, prompt);
    const state = stateOf(picture, prompt.process, prompt.element);
    state.asking = true;
    state.last = record.t;
  },
  PromptAnswered: (picture, record) => closePrompt(picture, text(record, "prompt"), record.t),
  PromptWithdrawn: (picture, record) => closePrompt(picture, text(record, "prompt"), record.t),
  OperatorTookControl: (picture, record) => {
    picture.holders.set(text(record, "resource"), text(record, "by"));
  },
  OperatorGaveControlBack: (picture, record) => {
    picture.holders.delete(text(record, "resource"));
  },
};

export function promptOf(record: RunRecord): Prompt {
  return {
    run: record.run,
    prompt: text(record, "prompt"),
    process: record.process ?? "",
    element: record.element ?? "",
    text: text(record, "text"),
    decisions: (record.decisions as Prompt["decisions"] | undefined) ?? [],
    role: text(record, "role"),
  };
}

function enter(picture: Picture, record: RunRecord): void {
  const { token = 0, process = "", element = "" } = record;
  picture.tokens.set(token, { process, element });
  const state = stateOf(picture, process, element);
  state.active += 1;
  state.hits += 1;
  state.last = record.t;
  state.failed = false;
}

function leave(picture: Picture, token: number, t: number, outcome: string): void {
  const at = picture.tokens.get(token);
  if (!at) return;
  picture.tokens.delete(token);
  const state = stateOf(picture, at.process, at.element);
  if (!picture.around.delete(token)) state.active -= 1;
  state.last = t;
  state.failed = outcome === "failed";
}

/** Instances of an activity are counted in the place of the token that waits around them. */
function surround(picture: Picture, record: RunRecord): void {
  const { token, process = "", element = "", instances } = record;
  if (instances === undefined || instances === null || token === undefined) return;
  if (!picture.tokens.has(token)) return;
  picture.around.add(token);
  const state = stateOf(picture, process, element);
  state.active -= 1;
  state.hits -= 1;
}

function closePrompt(picture: Picture, prompt: string, t: number): void {
  const closed = picture.prompts.get(prompt);
  if (!closed) return;
  picture.prompts.delete(prompt);
  const others = [...picture.prompts.values()];
  const state = stateOf(picture, closed.process, closed.element);
  state.asking = others.some(
    (other) => other.process === closed.process && other.element === closed.element,
  );
  state.last = t;
}

function stateOf(picture: Picture, process: string, element: string): ElementState {
  const states = (picture.elements[process] ??= {});
  return (states[element] ??= { active: 0, hits: 0, last: 0, failed: false, asking: false });
}

function text(record: RunRecord, field: string): string {
  const value = record[field];
  return typeof value === "string" ? value : "";
}
