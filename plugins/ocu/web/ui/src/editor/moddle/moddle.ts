// What the editor needs to know of a moddle element: one element of the BPMN file.
export interface ModdleElement {
  readonly $type: string;
  readonly $attrs: Record<string, string>;
  readonly $descriptor: { name: string; isGeneric?: boolean };
  $parent?: ModdleElement | undefined;
  $instanceOf?(type: string): boolean;
  get(name: string): unknown;
  set(name: string, value: unknown): void;
}

/** Makes elements: bpmn-js's BpmnFactory, or a bare moddle in tests. */
export interface Factory {
  create(type: string, attributes?: Record<string, unknown>): ModdleElement;
}

export function isA(element: ModdleElement | undefined, type: string): boolean {
  return element?.$instanceOf?.(type) ?? false;
}

export function text(element: ModdleElement, name: string): string {
  const value = element.get(name);
  return typeof value === "string" ? value : "";
}

export function child(element: ModdleElement, name: string): ModdleElement | undefined {
  return element.get(name) as ModdleElement | undefined;
}

export function list(element: ModdleElement | undefined, name: string): ModdleElement[] {
  return (element?.get(name) as ModdleElement[] | undefined) ?? [];
}

/** A new element with what another has that this editor does not know. */
export function successor(
  factory: Factory,
  type: string,
  attributes: Record<string, unknown>,
  before?: ModdleElement,
): ModdleElement {
  const known = Object.entries(attributes).filter(([, value]) => value !== undefined);
  const made = factory.create(type, Object.fromEntries(known));
  if (before) Object.assign(made.$attrs, before.$attrs);
  return made;
}

export function adopt(parent: ModdleElement, ...elements: (ModdleElement | undefined)[]): void {
  for (const element of elements) if (element) element.$parent = parent;
}
