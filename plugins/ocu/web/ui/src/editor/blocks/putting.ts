// Where a block goes that is chosen while something is selected.
import type { ModdleElement } from "../moddle/moddle";
import type { Catalogue } from "../session/catalogue";
import type { Edits } from "../session/edits";
import type { Element } from "../session/services";
import type { Block } from "./blocks";
import { attachedOf, ATTACHED } from "./control/fragments";
import { isActivity, type Shape } from "./control/drawing";
import { isOpen, type Fragments } from "./control/placing";
import { contentChanges, typeOf } from "./making";
import { behaviorName, isNamedByItself } from "./naming";

export interface Tools {
  catalogue: Catalogue;
  edits: Edits;
  fragments: Fragments;
}

/** Puts a fragment behind an element, or on it, and any block in a place that is still open. False:
 * the block is appended, as any other element is. */
export function takesPlace(
  tools: Tools,
  at: Element,
  block: Block,
): boolean {
  const { content } = block;
  if (content.kind === "fragment") {
    const { of: kind, options } = content;
    const { width, height } = at as Shape;
    const isOn = ATTACHED.has(kind) && isActivity(at);
    tools.fragments.put(isOn ? attachedOf(kind, options, [width, height]) : content.fragment, at);
    return true;
  }
  if (!isOpen(at)) return false;
  becomeBlock(tools, at, block);
  return true;
}

/** A task becomes a block; a name that people gave it stays. */
export function becomeBlock(
  tools: Tools,
  element: Element,
  block: Block,
): void {
  const { content } = block;
  if (content.kind === "fragment") {
    tools.fragments.put(content.fragment, element);
    return;
  }
  const { catalogue, edits } = tools;
  const object = element.businessObject as ModdleElement;
  const isNamed = Boolean(object.get("name")) && !isNamedByItself(catalogue, object);
  edits.replace(element, typeOf(content), (task) => {
    const changes = contentChanges(edits.factory, content, task);
    if (isNamed) return changes;
    const name =
      content.kind === "behavior" ? behaviorName(catalogue, content.use) : block.title;
    return [...changes, { target: task, properties: { name } }];
  });
}
