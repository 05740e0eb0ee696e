// What every form of the properties panel gets.
import type { EditorContext } from "../panels/panel";
import type { Change } from "../moddle/extensions";
import type { Factory, ModdleElement } from "../moddle/moddle";
import type { Element } from "../session/services";

export interface FormProps {
  element: Element;
  editor: EditorContext;
  /** Grows with every change: the element stays the same object when it is changed. */
  revision: number;
}

export function objectOf({ element }: FormProps): ModdleElement {
  return element.businessObject as ModdleElement;
}

export function factoryOf({ editor }: FormProps): Factory {
  return editor.service("edits").factory;
}

export function apply({ element, editor }: FormProps, changes: readonly Change[]): void {
  editor.service("edits").apply(element, changes);
}

export function set(
  form: FormProps,
  target: ModdleElement,
  properties: Record<string, unknown>,
): void {
  apply(form, [{ target, properties }]);
}

export function definitionsOf(form: FormProps): ModdleElement {
  let at = objectOf(form);
  while (at.$parent) at = at.$parent;
  return at;
}
