// Changes of the mission that are undone and redone as one.
import { isNamedByItself, nameOf } from "../blocks/naming";
import type { Change } from "../moddle/extensions";
import type { Factory, ModdleElement } from "../moddle/moddle";
import type { Catalogue } from "./catalogue";
import type { BpmnReplace, CommandStack, Element, Modeling } from "./services";

const CHANGE = "m2pem.change";
const REPLACE = "m2pem.replace";
const TOGETHER = "m2pem.together";

interface ChangeContext {
  element: Element;
  changes: readonly Change[];
}

interface ReplaceContext {
  element: Element;
  type: string;
  changes(task: ModdleElement): readonly Change[];
  result?: Element;
}

class ChangeHandler {
  static readonly $inject = ["modeling", "catalogue"];

  constructor(
    private readonly modeling: Modeling,
    private readonly catalogue: Catalogue,
  ) {}

  preExecute({ element, changes }: ChangeContext): void {
    const object = element.businessObject as ModdleElement;
    const isNamed = isNamedByItself(this.catalogue, object);
    for (const { target, properties, shown } of changes) {
      this.modeling.updateModdleProperties((shown as Element) ?? element, target, properties);
    }
    const name = isNamed ? nameOf(this.catalogue, object) : "";
    if (name && name !== object.get("name")) {
      this.modeling.updateProperties(element as never, { name });
    }
  }
}

class ReplaceHandler {
  static readonly $inject = ["modeling", "bpmnReplace"];

  constructor(
    private readonly modeling: Modeling,
    private readonly bpmnReplace: BpmnReplace,
  ) {}

  preExecute(context: ReplaceContext): void {
    const isSame = context.element.businessObject.$type === context.type;
    const target = { type: context.type } as Parameters<BpmnReplace["replaceElement"]>[1];
    const element = isSame
      ? context.element
      : (this.bpmnReplace.replaceElement(context.element, target) as Element);
    for (const { target, properties } of context.changes(element.businessObject)) {
      this.modeling.updateModdleProperties(element, target, properties);
    }
    context.result = element;
  }
}

class TogetherHandler {
  preExecute({ steps }: { steps: () => void }): void {
    steps();
  }
}

export class Edits {
  static readonly $inject = ["commandStack", "bpmnFactory"];
  readonly factory: Factory;

  constructor(
    private readonly commandStack: CommandStack,
    bpmnFactory: unknown,
  ) {
    this.factory = bpmnFactory as Factory;
    commandStack.registerHandler(CHANGE, ChangeHandler);
    commandStack.registerHandler(REPLACE, ReplaceHandler);
    commandStack.registerHandler(TOGETHER, TogetherHandler);
  }

  apply(element: Element, changes: readonly Change[]): void {
    const context: ChangeContext = { element, changes };
    this.commandStack.execute(CHANGE, context);
  }

  set(element: Element, target: ModdleElement, properties: Record<string, unknown>): void {
    this.apply(element, [{ target, properties }]);
  }

  /** Several changes that are undone and redone as one. */
  together(steps: () => void): void {
    this.commandStack.execute(TOGETHER, { steps });
  }

  /** Another type of element in the same place, with changes of its own. */
  replace(
    element: Element,
    type: string,
    changes: (task: ModdleElement) => readonly Change[],
  ): Element {
    const context: ReplaceContext = { element, type, changes };
    this.commandStack.execute(REPLACE, context);
    return context.result ?? element;
  }
}

export const editsModule = { __init__: ["edits"], edits: ["type", Edits] };
