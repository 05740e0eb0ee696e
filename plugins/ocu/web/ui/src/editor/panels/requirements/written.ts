// The requirements of the mission that is drawn, and changes to them, which can be undone.
import { text, type ModdleElement } from "../../moddle/moddle";
import { DEFAULT_STORE } from "../../moddle/prompts";
import {
  freeId,
  requirementsOf,
  setRequirements,
  type Requirement,
} from "../../moddle/requirements";
import type { Element } from "../../session/services";
import { beginningOf } from "../begin/beginning";
import { askingTasks, processesOf, showsProcess } from "../drawn";
import type { EditorContext } from "../panel";
import type { Vocabulary } from "./completion";
import { isList, patternNamed } from "./patterns";

/** A requirement with the process in whose extension elements it is, and its place there. */
export interface Placed {
  process: ModdleElement;
  index: number;
  requirement: Requirement;
}

export function placed(editor: EditorContext): Placed[] {
  return processesOf(editor).flatMap((process) =>
    requirementsOf(process).map((requirement, index) => ({ process, index, requirement })),
  );
}

export function change({ process, index }: Placed, editor: EditorContext, next: Requirement): void {
  write(editor, process, requirementsOf(process).with(index, next));
}

export function removeFrom({ process, index }: Placed, editor: EditorContext): void {
  write(editor, process, requirementsOf(process).toSpliced(index, 1));
}

/** Adds one to the process that a run begins with; gives back its id. `pattern` "": a formula. */
export function add(editor: EditorContext, pattern: string): string | undefined {
  const process = main(editor);
  if (!process) return undefined;
  const taken = placed(editor).map(({ requirement }) => requirement.id);
  const id = freeId((pattern || "formula").replaceAll("_", "-"), taken);
  const ltl = pattern ? null : "";
  const made = ofPattern({
    id,
    text: "",
    ltl,
    pattern,
    args: {},
    fair: "",
    assume: "",
    monitor: "",
    onViolation: "",
  });
  write(editor, process, [...requirementsOf(process), made]);
  return id;
}

/** With the arguments that its pattern needs, as far as they are not there yet. */
export function ofPattern(requirement: Requirement): Requirement {
  const known = patternNamed(requirement.pattern);
  if (requirement.ltl !== null || !known) return requirement;
  const needed = known.arguments
    .filter((each) => each.required)
    .map(
      ({ name, kind }) => [name, isList(kind) ? ["", ""] : [kind === "count" ? "1" : ""]] as const,
    );
  const names = new Set(known.arguments.map(({ name }) => name));
  const kept = Object.entries(requirement.args).filter(([name]) => names.has(name));
  return { ...requirement, args: { ...Object.fromEntries(needed), ...Object.fromEntries(kept) } };
}

export function vocabularyOf(editor: EditorContext): Vocabulary {
  const { catalogue, checks } = editor;
  const outline = checks.outline.value;
  const { vehicles, payloads, teams } = catalogue.fleet;
  const named = (outline?.processes ?? []).map(({ id, name }) => ({ id, name, type: "process" }));
  const drawn = (outline?.elements ?? []).filter(({ type }) => !NOT_ASKED_FOR.test(type));
  return {
    elements: [...drawn, ...named],
    resources: [...vehicles, ...payloads].map(({ id }) => id).concat(teams.map(({ name }) => name)),
    behaviors: [...new Set(catalogue.behaviors.map(({ name }) => name))].sort(),
    names: outline?.names ?? [],
    decided: askingTasks(editor).map(({ store, decisions }) => ({
      store: store || DEFAULT_STORE,
      values: decisions,
    })),
  };
}

/** What operators can decide at a user task. */
export function decisionsAt(editor: EditorContext, task: string): string[] {
  const asking = askingTasks(editor).find(({ id }) => id === task);
  return asking?.decisions.map(({ value }) => value) ?? [];
}

const NOT_ASKED_FOR = /flow$|^data|annotation$|association$/i;

function main(editor: EditorContext): ModdleElement | undefined {
  const all = processesOf(editor);
  const said = beginningOf(editor).process.value;
  const starts = editor.checks.outline.value?.processes.find((each) => each.starts)?.id;
  return all.find((each) => text(each, "id") === (said || starts)) ?? all[0];
}

function write(
  editor: EditorContext,
  process: ModdleElement,
  requirements: readonly Requirement[],
): void {
  const edits = editor.service("edits");
  const root = editor.service("canvas").getRootElement() as Element;
  const shown = editor.service("elementRegistry").find((each) => showsProcess(each, process));
  edits.apply((shown as Element) ?? root, setRequirements(edits.factory, process, requirements));
}
