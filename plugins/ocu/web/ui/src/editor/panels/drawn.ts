// What the mission has as it is drawn now, in all of its diagrams.
import { child, isA, list, text, type ModdleElement } from "../moddle/moddle";
import { behaviorOf, serviceOf } from "../moddle/behavior";
import { promptOf } from "../moddle/prompts";
import type { EditorContext } from "./panel";

export interface Task {
  id: string;
  name: string;
}

export interface AskingTask extends Task {
  store: string;
  decisions: { value: string; label: string }[];
}

export function definitionsOf(editor: EditorContext): ModdleElement | undefined {
  let at = editor.service("canvas").getRootElement().businessObject as ModdleElement | undefined;
  while (at?.$parent) at = at.$parent;
  return at;
}

export function processesOf(editor: EditorContext): ModdleElement[] {
  return list(definitionsOf(editor), "rootElements").filter((each) => isA(each, "bpmn:Process"));
}

/** With those in subprocesses. */
export function flowElements(container: ModdleElement): ModdleElement[] {
  return list(container, "flowElements").flatMap((each) =>
    isA(each, "bpmn:SubProcess") ? [each, ...flowElements(each)] : [each],
  );
}

const task = (element: ModdleElement): Task => ({
  id: text(element, "id"),
  name: text(element, "name"),
});

export function askingTasks(editor: EditorContext): AskingTask[] {
  return processesOf(editor)
    .flatMap(flowElements)
    .filter((each) => isA(each, "bpmn:UserTask"))
    .map((each) => {
      const { prompt } = promptOf(each);
      return { ...task(each), store: prompt.store, decisions: prompt.decisions };
    });
}

export function commandingTasks(editor: EditorContext): Task[] {
  const all = processesOf(editor).flatMap(flowElements);
  return all.filter((each) => behaviorOf(each) !== undefined).map(task);
}

export function servingTasks(editor: EditorContext): Task[] {
  const all = processesOf(editor).flatMap(flowElements);
  const serving = all.filter((each) => isA(each, "bpmn:ServiceTask") && !behaviorOf(each));
  return serving.filter((each) => serviceOf(each) !== undefined).map(task);
}

/** Whether an element on the canvas is a process, or the pool that shows it. */
export function showsProcess(
  element: { businessObject?: unknown },
  process: ModdleElement,
): boolean {
  const object = element.businessObject as ModdleElement | undefined;
  if (!object || object === process) return object === process;
  return isA(object, "bpmn:Participant") && child(object, "processRef") === process;
}
