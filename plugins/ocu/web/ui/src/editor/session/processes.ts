// Processes that are added with a diagram of their own, and removed with it: undone as all else is.
import { adopt, child, list, text, type Factory, type ModdleElement } from "../moddle/moddle";
import { outermostOf, ownerOf } from "./planes";
import type { Canvas, CommandStack, ElementFactory, EventBus } from "./services";

const ADD = "m2pem.process.add";
const REMOVE = "m2pem.process.remove";

type Root = ReturnType<Canvas["getRootElement"]>;
type Drawn = Root["children"][number];

interface Place {
  element: Drawn;
  parent: Drawn;
  index: number;
}

/** A process, or a collaboration with its processes: what the file and the canvas have of it. The
 * very same comes and goes, so that what was done to it before can still be undone. */
interface Part {
  definitions: ModdleElement;
  roots: readonly Root[];
  drawn: readonly Place[];
  /** What is shown without it. */
  other: Root;
  withIt: Lists;
  without: Lists;
}

interface Lists {
  rootElements: ModdleElement[];
  diagrams: ModdleElement[];
}

class Swap {
  static readonly $inject = ["canvas", "eventBus"];

  constructor(
    private readonly canvas: Canvas,
    private readonly eventBus: EventBus,
  ) {}

  protected put({ definitions, roots, drawn, withIt }: Part): [] {
    write(definitions, withIt);
    for (const root of roots) this.canvas.addRootElement(root as never);
    this.canvas.setRootElement(roots[0]!);
    for (const { element, parent, index } of drawn) {
      if ("waypoints" in element) this.canvas.addConnection(element as never, parent as never, index);
      else this.canvas.addShape(element as never, parent as never, index);
    }
    // The marks that lead into collapsed subprocesses are made when a diagram has been drawn.
    this.eventBus.fire("import.render.complete", { warnings: [] });
    return [];
  }

  protected take({ definitions, roots, drawn, other, without }: Part): [] {
    write(definitions, without);
    this.canvas.setRootElement(other);
    for (const { element } of [...drawn].reverse()) {
      if ("waypoints" in element) this.canvas.removeConnection(element as never);
      else this.canvas.removeShape(element as never);
    }
    for (const root of roots) this.canvas.removeRootElement(root as never);
    return [];
  }
}

class AddHandler extends Swap {
  execute = (part: Part) => this.put(part);
  revert = (part: Part) => this.take(part);
}

class RemoveHandler extends Swap {
  execute = (part: Part) => this.take(part);
  revert = (part: Part) => this.put(part);
}

export class Processes {
  static readonly $inject = ["canvas", "commandStack", "elementFactory", "bpmnFactory"];
  private readonly factory: Factory;

  constructor(
    private readonly canvas: Canvas,
    private readonly commandStack: CommandStack,
    private readonly elementFactory: ElementFactory,
    bpmnFactory: unknown,
  ) {
    this.factory = bpmnFactory as Factory;
    commandStack.registerHandler(ADD, AddHandler);
    commandStack.registerHandler(REMOVE, RemoveHandler);
  }

  /** An empty one, which is shown. */
  add(definitions: ModdleElement, name: string): void {
    const process = this.factory.create("bpmn:Process", { name, isExecutable: true });
    const di = this.factory.create("bpmndi:BPMNPlane", { bpmnElement: process, planeElement: [] });
    const diagram = this.factory.create("bpmndi:BPMNDiagram", { plane: di });
    adopt(diagram, di);
    adopt(definitions, process, diagram);
    const attributes = { type: "bpmn:Process", businessObject: process, di };
    const root = this.elementFactory.createRoot(attributes as never) as Root;
    const without = read(definitions);
    const withIt = {
      rootElements: [...without.rootElements, process],
      diagrams: [...without.diagrams, diagram],
    };
    const other = this.canvas.getRootElement();
    const part: Part = { definitions, roots: [root], drawn: [], other, withIt, without };
    this.commandStack.execute(ADD, part);
  }

  /** The one that is shown; then another is. */
  remove(definitions: ModdleElement, other: Root): void {
    const owner = outermostOf(this.canvas.getRootElement().businessObject as ModdleElement);
    const isIts = (each: ModdleElement | undefined) => outermostOf(each) === owner;
    const all = this.canvas.getRootElements() as Root[];
    const its = all.filter((root) => isIts(root.businessObject as ModdleElement));
    const isInner = (root: Root) => text(root.businessObject as ModdleElement, "id") !== owner;
    const roots = its.sort((a, b) => Number(isInner(a)) - Number(isInner(b)));
    const withIt = read(definitions);
    const pools = list(
      withIt.rootElements.find((each) => text(each, "id") === owner),
      "participants",
    );
    const processes = new Set(pools.map((pool) => child(pool, "processRef")));
    const without = {
      rootElements: withIt.rootElements.filter(
        (each) => text(each, "id") !== owner && !processes.has(each),
      ),
      diagrams: withIt.diagrams.filter((each) => !isIts(ownerOf(each))),
    };
    const drawn = roots.flatMap(placesIn);
    const part: Part = { definitions, roots, drawn, other, withIt, without };
    this.commandStack.execute(REMOVE, part);
  }
}

function read(definitions: ModdleElement): Lists {
  return {
    rootElements: [...list(definitions, "rootElements")],
    diagrams: [...list(definitions, "diagrams")],
  };
}

function write(definitions: ModdleElement, { rootElements, diagrams }: Lists): void {
  definitions.set("rootElements", [...rootElements]);
  definitions.set("diagrams", [...diagrams]);
}

function placesIn(parent: Drawn): Place[] {
  const children = (parent.children ?? []) as Drawn[];
  return children.flatMap((element, index) => [{ element, parent, index }, ...placesIn(element)]);
}

export const processesModule = { __init__: ["processes"], processes: ["type", Processes] };
