// The diagrams of a file: one a process or collaboration; those of collapsed subprocesses open from
// within them.
import { signal } from "@preact/signals";
import { adopt, child, isA, list, text, type Factory, type ModdleElement } from "../moddle/moddle";
import { fitTo } from "./fitting";
import type { MissionModeler } from "./modeler";

export interface Diagram {
  id: string;
  title: string;
  /** Of the process or collaboration. */
  owner: string;
}

export class Diagrams {
  readonly all = signal<readonly Diagram[]>([]);
  readonly current = signal("");

  constructor(
    private readonly modeler: MissionModeler,
    private readonly beforeOpening: () => void,
  ) {}

  /** What is drawn has changed, or a name has. */
  refresh(): void {
    this.all.value = this.elements().map((diagram) => {
      const owner = child(child(diagram, "plane")!, "bpmnElement")!;
      return { id: text(diagram, "id"), title: titleOf(diagram, owner), owner: text(owner, "id") };
    });
    const root = this.modeler.get("canvas").getRootElement().businessObject as ModdleElement;
    const outermost = outermostOf(root);
    const shown = this.all.value.find(({ owner }) => owner === outermost);
    if (shown) this.current.value = shown.id;
  }

  async open(id: string): Promise<void> {
    if (id === this.current.value) return;
    this.beforeOpening();
    await this.modeler.open(id);
    this.current.value = id;
    fitTo(this.modeler.get("canvas"));
  }

  /** The diagram on which an element is drawn, or that of the process around it. */
  of(element: string): Diagram | undefined {
    const found = this.elements().find((diagram) => draws(diagram, element));
    if (found) return this.all.value.find(({ id }) => id === text(found, "id"));
    const inner = list(this.definitions(), "diagrams").find((diagram) => draws(diagram, element));
    const owner = inner && child(child(inner, "plane")!, "bpmnElement");
    if (!owner) return this.all.value.find((each) => each.owner === element);
    const outermost = outermostOf(owner);
    return this.all.value.find((each) => each.owner === outermost);
  }

  /** An empty process with a diagram of its own. */
  async add(name: string): Promise<void> {
    const definitions = this.definitions();
    const factory = this.modeler.get("bpmnFactory") as unknown as Factory;
    const process = factory.create("bpmn:Process", { name, isExecutable: true });
    const plane = factory.create("bpmndi:BPMNPlane", { bpmnElement: process, planeElement: [] });
    const diagram = factory.create("bpmndi:BPMNDiagram", { plane });
    adopt(definitions, process, diagram);
    adopt(diagram, plane);
    list(definitions, "rootElements").push(process);
    list(definitions, "diagrams").push(diagram);
    this.refresh();
    await this.open(text(diagram, "id"));
  }

  /** Removes a diagram with its process, or with all processes of its pools. */
  async remove(id: string): Promise<void> {
    const definitions = this.definitions();
    const diagram = this.elements().find((each) => text(each, "id") === id);
    const other = this.all.value.find((each) => each.id !== id);
    if (!diagram || !other) return;
    await this.open(other.id);
    const owner = child(child(diagram, "plane")!, "bpmnElement")!;
    const pools = list(owner, "participants").map((each) => child(each, "processRef"));
    const gone = new Set<ModdleElement | undefined>([owner, ...pools]);
    const owners = new Set([...gone].filter((each) => each).map((each) => text(each!, "id")));
    const stays = (each: ModdleElement) => !owners.has(outermostOf(ownerOf(each)));
    definitions.set(
      "rootElements",
      list(definitions, "rootElements").filter((each) => !gone.has(each)),
    );
    definitions.set("diagrams", list(definitions, "diagrams").filter(stays));
    this.refresh();
  }

  private definitions(): ModdleElement {
    return this.modeler.getDefinitions() as ModdleElement;
  }

  private elements(): ModdleElement[] {
    return list(this.definitions(), "diagrams").filter((diagram) => {
      const owner = ownerOf(diagram);
      return isA(owner, "bpmn:Process") || isA(owner, "bpmn:Collaboration");
    });
  }
}

function ownerOf(diagram: ModdleElement): ModdleElement | undefined {
  const plane = child(diagram, "plane");
  return plane && child(plane, "bpmnElement");
}

function draws(diagram: ModdleElement, element: string): boolean {
  const shapes = list(child(diagram, "plane"), "planeElement");
  return shapes.some((shape) => {
    const drawn = child(shape, "bpmnElement");
    return drawn !== undefined && text(drawn, "id") === element;
  });
}

/** The id of the process or collaboration that something stands in. */
function outermostOf(element: ModdleElement | undefined): string {
  let at = element;
  while (at?.$parent && !isA(at.$parent, "bpmn:Definitions")) at = at.$parent;
  if (!at) return "";
  const siblings = list(at.$parent, "rootElements");
  const collaboration = siblings.find((each) =>
    list(each, "participants").some((pool) => child(pool, "processRef") === at),
  );
  return text(collaboration ?? at, "id");
}

function titleOf(diagram: ModdleElement, owner: ModdleElement): string {
  const pools = list(owner, "participants").map((each) => text(each, "name") || text(each, "id"));
  const own = text(owner, "name") || text(diagram, "name");
  return own || pools.join(", ") || text(owner, "id");
}
