// Where a block goes that is chosen while something is selected.
import type { ModdleElement } from "../moddle/moddle";
import type { Edits } from "../session/edits";
import type { Element } from "../session/services";
import type { Block, TaskContent } from "./blocks";
import { attachedOf, ATTACHED } from "./control/fragments";
import { isActivity, type Shape } from "./control/drawing";
import { isOpen, type Fragments } from "./control/placing";
import { contentChanges, typeOf } from "./making";

/** Puts a fragment behind an element, or on it, and any block in a place that is still open. False:
 * the block is appended, as any other element is. */
export function takesPlace(
  fragments: Fragments,
  edits: Edits,
  at: Element,
  block: Block,
): boolean {
  const { content } = block;
  if (content.kind === "fragment") {
    const { of: kind, options } = content;
    const { width, height } = at as Shape;
    const isOn = ATTACHED.has(kind) && isActivity(at);
    fragments.put(isOn ? attachedOf(kind, options, [width, height]) : content.fragment, at);
    return true;
  }
  if (!isOpen(at)) return false;
  becomeBlock(fragments, edits, at, block);
  return true;
}

/** A task becomes a block; a name that people gave it stays. */
export function becomeBlock(
  fragments: Fragments,
  edits: Edits,
  element: Element,
  block: Block,
): void {
  const { content } = block;
  if (content.kind === "fragment") {
    fragments.put(content.fragment, element);
    return;
  }
  const isNamed = Boolean(element.businessObject.get("name")) && !isOpen(element);
  edits.replace(element, typeOf(content), (task) => changesOf(edits, block, content, task, isNamed));
}

function changesOf(
  edits: Edits,
  block: Block,
  content: TaskContent,
  task: ModdleElement,
  isNamed: boolean,
) {
  const changes = contentChanges(edits.factory, content, task);
  return isNamed ? changes : [...changes, { target: task, properties: { name: block.title } }];
}
