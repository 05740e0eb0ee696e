// Copies keep the extension elements of other tools, which bpmn-js leaves out.
import type { ModdleElement } from "../moddle/moddle";
import type { EventBus } from "./services";

interface CopyEvent {
  property: unknown;
  parent: ModdleElement;
}

interface AnyElement extends ModdleElement {
  $children?: AnyElement[];
  $body?: string;
}

interface Moddle {
  createAny(type: string, uri: string, properties: object): AnyElement;
}

/** Before bpmn-js has its say. */
const EARLY = 2000;

export class ForeignCopy {
  static readonly $inject = ["eventBus", "moddle"];

  constructor(
    eventBus: EventBus,
    private readonly moddle: Moddle,
  ) {
    const copy = ({ property, parent }: CopyEvent) =>
      isForeign(property) ? this.copied(property, parent) : undefined;
    eventBus.on("moddleCopy.canCopyProperty", EARLY, copy as never);
  }

  private copied(element: AnyElement, parent: ModdleElement): AnyElement {
    const { $type, $children, $body, $descriptor, $parent, $instanceOf, ...attributes } =
      element as AnyElement & Record<string, unknown>;
    void $parent;
    void $instanceOf;
    const { ns } = $descriptor as unknown as { ns: { uri: string } };
    const made = this.moddle.createAny($type, ns.uri, {
      ...attributes,
      ...($body ? { $body } : {}),
    });
    made.$parent = parent;
    if ($children) made.$children = $children.map((each) => this.copied(each, made));
    return made;
  }
}

function isForeign(value: unknown): value is AnyElement {
  return (value as ModdleElement | undefined)?.$descriptor?.isGeneric === true;
}

export const foreignCopyModule = {
  __init__: ["foreignCopy"],
  foreignCopy: ["type", ForeignCopy],
};
