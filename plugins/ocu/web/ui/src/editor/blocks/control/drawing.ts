// The elements and flows of a fragment, before they are in the diagram.
import { isA, type Factory, type ModdleElement } from "../../moddle/moddle";
import { makeRoot, rootNamed, type RootKind } from "../../moddle/roots";
import type { Box } from "../../session/boxes";
import type { Element, ElementFactory } from "../../session/services";
import { contentChanges, written } from "../making";
import { sizeOf, type EventUse, type FragmentFlow, type FragmentNode } from "./fragment";

export type Shape = Element & Box & { parent: Shape; outgoing: Flow[]; incoming: Flow[] };
export type Flow = Element & { source: Shape; target: Shape; waypoints: { x: number; y: number }[] };

/** Shapes and flows of fragments; `definitions`: those of the file. */
export class FragmentParts {
  constructor(
    private readonly factory: Factory,
    private readonly elementFactory: ElementFactory,
    private readonly definitions: () => ModdleElement,
  ) {}

  shape(node: FragmentNode): Shape {
    const { type, name } = node;
    const [width, height] = sizeOf(node);
    const object = this.factory.create(type, name ? { name } : {});
    if (node.event) this.addEvent(object, node.event);
    if (node.content) written(contentChanges(this.factory, node.content, object));
    if (node.times !== undefined) this.repeat(object, node.times);
    const made = this.elementFactory.createShape({
      type,
      businessObject: object,
      width,
      height,
      ...(type === "bpmn:SubProcess" ? { isExpanded: true } : {}),
    } as never);
    return made as unknown as Shape;
  }

  /** `x`, `y`: the centre of the entry. */
  flow({ name, when, way }: FragmentFlow, { x, y }: { x: number; y: number }): object {
    const condition = when ? { conditionExpression: this.expression(when) } : {};
    const object = this.factory.create("bpmn:SequenceFlow", { ...(name ? { name } : {}), ...condition });
    const type = "bpmn:SequenceFlow";
    const waypoints = way?.map(([right, down]) => ({ x: x + right, y: y + down }));
    return this.elementFactory.createConnection({
      type,
      businessObject: object,
      ...(waypoints ? { waypoints } : {}),
    } as never);
  }

  private expression(body: string): ModdleElement {
    return this.factory.create("bpmn:FormalExpression", { body });
  }

  private addEvent(object: ModdleElement, use: EventUse): void {
    const definition = this.definition(use);
    definition.$parent = object;
    object.set("eventDefinitions", [definition]);
  }

  private definition(use: EventUse): ModdleElement {
    const make = (type: string, properties: Record<string, unknown> = {}) =>
      this.factory.create(`bpmn:${type}EventDefinition`, properties);
    switch (use.kind) {
      case "timer":
        return make("Timer", { timeDuration: this.expression(use.after) });
      case "date":
        return make("Timer", { timeDate: this.expression(use.at) });
      case "condition":
        return make("Conditional", { condition: this.expression(use.when) });
      case "signal": {
        const signalRef = this.root("signal", use.name);
        if (use.fromOperators) signalRef.set("m2pem:from", "operator");
        return make("Signal", { signalRef });
      }
      case "escalation":
        return make("Escalation", { escalationRef: this.root("escalation", use.name) });
      case "error":
        return make("Error");
      case "terminate":
        return make("Terminate");
    }
  }

  private readonly fresh = new Map<string, ModdleElement>();

  /** bpmn-js adds a new one to the file, with the first event that refers to it. */
  private root(kind: RootKind, name: string): ModdleElement {
    const definitions = this.definitions();
    const known = rootNamed(definitions, kind, name) ?? this.fresh.get(`${kind} ${name}`);
    if (known) return known;
    const { root } = makeRoot(this.factory, definitions, kind, name);
    this.fresh.set(`${kind} ${name}`, root);
    return root;
  }

  private repeat(object: ModdleElement, times: number): void {
    const loop = this.factory.create("bpmn:MultiInstanceLoopCharacteristics", {
      isSequential: true,
      loopCardinality: this.expression(String(times)),
    });
    loop.$parent = object;
    object.set("loopCharacteristics", loop);
  }
}

export function centre({ x, y, width, height }: Box): { x: number; y: number } {
  return { x: x + width / 2, y: y + height / 2 };
}

export const isActivity = (element: Element): boolean =>
  isA(element.businessObject as ModdleElement, "bpmn:Activity");
