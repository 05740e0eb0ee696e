// Finds an element wherever it is drawn: on this diagram, on another, or in a collapsed subprocess.
import { child, isA, list, text, type ModdleElement } from "../moddle/moddle";
import { referencesOf } from "../moddle/roots";
import type { Diagrams } from "./diagrams";
import type { MissionModeler } from "./modeler";
import type { Element } from "./services";

const MARGIN = { top: 120, bottom: 120, left: 200, right: 200 };

export class Locator {
  constructor(
    private readonly modeler: MissionModeler,
    private readonly diagrams: Diagrams,
  ) {}

  /** Selects it and scrolls to it; false: it is not drawn. */
  async show(id: string): Promise<boolean> {
    const found = this.drawn(id) ?? (await this.drawnElsewhere(id));
    if (!found) return false;
    const canvas = this.modeler.get("canvas");
    const root = canvas.findRoot(found as never);
    if (root && root !== canvas.getRootElement()) canvas.setRootElement(root);
    this.modeler.get("selection").select(found as never);
    if (found.parent) canvas.scrollToElement(found as never, MARGIN);
    return true;
  }

  private drawn(id: string): Element | undefined {
    const registry = this.modeler.get("elementRegistry");
    const direct = registry.get(id) as Element | undefined;
    if (direct) return direct;
    return registry.filter((each) => standsFor(each.businessObject as ModdleElement, id))[0] as
      Element | undefined;
  }

  private async drawnElsewhere(id: string): Promise<Element | undefined> {
    const diagram = this.diagrams.of(id) ?? this.diagrams.of(this.userOf(id));
    if (!diagram || diagram.id === this.diagrams.current.value) return undefined;
    await this.diagrams.open(diagram.id);
    return this.drawn(id);
  }

  /** An event of any diagram that refers to a signal, message, error or escalation. */
  private userOf(root: string): string {
    const definitions = this.modeler.getDefinitions() as ModdleElement;
    const waiting = [...list(definitions, "rootElements")];
    for (let each = waiting.pop(); each; each = waiting.pop()) {
      if (refersTo(each, root)) return text(each, "id");
      waiting.push(...list(each, "flowElements"));
    }
    return "";
  }
}

/** A pool stands for its process, an event for what it refers to, a data reference for its object. */
function standsFor(element: ModdleElement, id: string): boolean {
  const process = isA(element, "bpmn:Participant") ? child(element, "processRef") : undefined;
  const isReference = isA(element, "bpmn:DataObjectReference");
  const object = isReference ? child(element, "dataObjectRef") : undefined;
  return [process, object].some((each) => each && text(each, "id") === id) || refersTo(element, id);
}

function refersTo(element: ModdleElement, id: string): boolean {
  const isEvent = isA(element, "bpmn:Event") || isA(element, "bpmn:Activity");
  return isEvent && referencesOf(element).some(({ root }) => root && text(root, "id") === id);
}
