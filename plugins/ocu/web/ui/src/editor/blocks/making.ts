// Tasks out of blocks.
import { setBehavior, setService } from "../moddle/behavior";
import type { Change } from "../moddle/extensions";
import type { Factory, ModdleElement } from "../moddle/moddle";
import { promptOf, setPrompt } from "../moddle/prompts";
import type { Element, ElementFactory } from "../session/services";
import { strings } from "../../strings";
import type { Block } from "./blocks";

const TYPES = {
  behavior: "bpmn:ScriptTask",
  service: "bpmn:ServiceTask",
  prompt: "bpmn:UserTask",
} as const;

export function typeOf(block: Block): string {
  return TYPES[block.content.kind];
}

/** What makes a task of the right type do what a block says. */
export function contentChanges(factory: Factory, block: Block, task: ModdleElement): Change[] {
  const { content } = block;
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

export function makeShape(factory: Factory, elementFactory: ElementFactory, block: Block): Element {
  const type = typeOf(block);
  const task = factory.create(type, { name: block.title });
  for (const { target, properties } of contentChanges(factory, block, task)) {
    for (const [name, value] of Object.entries(properties)) target.set(name, value);
  }
  return elementFactory.createShape({ type, businessObject: task }) as Element;
}
