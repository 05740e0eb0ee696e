// Tasks out of blocks.
import { setBehavior, setService } from "../moddle/behavior";
import type { Change } from "../moddle/extensions";
import type { Factory, ModdleElement } from "../moddle/moddle";
import { promptOf, setPrompt } from "../moddle/prompts";
import type { Element, ElementFactory } from "../session/services";
import { strings } from "../../strings";
import type { Catalogue } from "../session/catalogue";
import { nameOf } from "./naming";
import type { Block, TaskContent } from "./blocks";
import type { Fragment } from "./control/fragment";

const TYPES = {
  behavior: "bpmn:ScriptTask",
  service: "bpmn:ServiceTask",
  prompt: "bpmn:UserTask",
} as const;

export function typeOf({ kind }: TaskContent): string {
  return TYPES[kind];
}

/** What makes a task of the right type do what a block says. */
export function contentChanges(
  factory: Factory,
  content: TaskContent,
  task: ModdleElement,
): Change[] {
  if (content.kind === "behavior") return setBehavior(factory, task, content.use);
  if (content.kind === "service") return setService(factory, task, content.use);
  const { prompt } = promptOf(task);
  if (prompt.decisions.length > 0) return [];
  const { continueLabel, abortLabel } = strings.editor.blocks;
  return setPrompt(factory, task, {
    ...prompt,
    decisions: [
      { value: "continue", label: continueLabel },
      { value: "abort", label: abortLabel },
    ],
  });
}

export function makeShape(
  factory: Factory,
  elementFactory: ElementFactory,
  catalogue: Catalogue,
  block: Block,
): Element {
  const { content } = block;
  if (content.kind === "fragment") return openPlace(factory, elementFactory, content.fragment);
  const type = typeOf(content);
  const task = factory.create(type, { name: block.title });
  written(contentChanges(factory, content, task));
  task.set("name", nameOf(catalogue, task) || block.title);
  return elementFactory.createShape({ type, businessObject: task }) as Element;
}

/** What is dragged for a fragment, which then takes its place. */
function openPlace(factory: Factory, elementFactory: ElementFactory, fragment: Fragment): Element {
  const type = "bpmn:ScriptTask";
  const businessObject = factory.create(type, { name: strings.control.open });
  const shape = elementFactory.createShape({ type, businessObject }) as Element;
  return Object.assign(shape, { m2Fragment: fragment });
}

/** Writes changes of an element that is not in the diagram yet. */
export function written(changes: readonly Change[]): void {
  for (const { target, properties } of changes) {
    for (const [name, value] of Object.entries(properties)) target.set(name, value);
  }
}

/** How a block is dragged: of a fragment, what is selected then is not what was dragged. */
export function draggingOf({ content }: Block): { hints?: { autoSelect: boolean } } {
  return content.kind === "fragment" ? { hints: { autoSelect: false } } : {};
}
