// The extension elements of a BPMN element, and changes to them: each a command that can be undone.
import { adopt, child, isA, list, type Factory, type ModdleElement } from "./moddle";

/** New values of one element of the file. */
export interface Change {
  target: ModdleElement;
  properties: Record<string, unknown>;
  /** What is drawn of it, where that is another one than of the command as a whole. */
  shown?: unknown;
}

export function extensions(element: ModdleElement, type: string): ModdleElement[] {
  return list(child(element, "extensionElements"), "values").filter((each) => isA(each, type));
}

export function extension(element: ModdleElement, type: string): ModdleElement | undefined {
  return extensions(element, type)[0];
}

/** Puts elements where those of some types stand; what else stands there is kept, in order. */
export function replaced(
  factory: Factory,
  element: ModdleElement,
  types: readonly string[],
  replacements: readonly ModdleElement[],
): Change {
  const outer = child(element, "extensionElements");
  const before = list(outer, "values");
  const isOld = (each: ModdleElement) => types.some((type) => isA(each, type));
  const at = before.findIndex(isOld);
  const values = before.filter((each) => !isOld(each));
  values.splice(at < 0 ? values.length : at, 0, ...replacements);
  if (values.length === 0) return { target: element, properties: { extensionElements: undefined } };
  if (outer) {
    adopt(outer, ...replacements);
    return { target: outer, properties: { values } };
  }
  const made = factory.create("bpmn:ExtensionElements", { values });
  adopt(made, ...values);
  adopt(element, made);
  return { target: element, properties: { extensionElements: made } };
}
