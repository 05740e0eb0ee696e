// Puts fragments into the diagram, each as one step that is undone as one: behind an element, in the
// way of a flow, in a place that is still open, or on an activity.
import { isA, type Factory, type ModdleElement } from "../../moddle/moddle";
import { overlap, type Box } from "../../session/boxes";
import { fitTo } from "../../session/fitting";
import type {
  Canvas,
  CommandStack,
  Element,
  ElementFactory,
  EventBus,
  Modeling,
  Selection,
  SpaceTool,
} from "../../session/services";
import { centre, FragmentParts, isActivity, type Flow, type Shape } from "./drawing";
import { extentOf, HOST, type Fragment } from "./fragment";
import { isOpenPlace } from "./open";

const PUT = "m2pem.fragment";
const DISTANCE = 50;
const MARGIN = 20;
/** Names can be read at it. */
const LEAST_SCALE = 0.5;
/** After bpmn-js has selected what was dragged to its place. */
const AFTER_SELECTION = 100;

interface Put {
  fragment: Fragment;
  /** What comes before, is still open, or is put on; null: it stands alone at `position`. */
  at: Shape | null;
  position: { x: number; y: number };
  parent: Shape;
  result?: Shape;
}

interface Modeler {
  getDefinitions(): ModdleElement;
}

export const isOpen = (element: Element): boolean =>
  isOpenPlace(element.businessObject as ModdleElement);

class PutHandler {
  static readonly $inject = ["modeling", "spaceTool", "canvas", "bpmnFactory", "elementFactory", "bpmnjs"];

  constructor(
    private readonly modeling: Modeling,
    private readonly spaceTool: SpaceTool,
    private readonly canvas: Canvas,
    private readonly factory: Factory,
    private readonly elementFactory: ElementFactory,
    private readonly modeler: Modeler,
  ) {}

  preExecute(put: Put): void {
    const { fragment, at } = put;
    if (!at) {
      put.result = this.draw(put, put.position, null);
      return;
    }
    if (fragment.entry === HOST && isActivity(at) && !isDrawnBy(fragment)) this.putOn(put, at);
    else if (isOpen(at)) this.putInPlaceOf(put, at);
    else this.putBehind(put, at);
  }

  /** On an activity: what came behind it comes behind both ways. */
  private putOn(put: Put, host: Shape): void {
    const after = sequenceFlows(host.outgoing);
    const extent = extentOf(put.fragment);
    this.makeRoom(host, after.length > 0, extent.right - host.width / 2, extent.bottom);
    put.result = this.draw(put, centre(host), host, after);
  }

  private putInPlaceOf(put: Put, open: Shape): void {
    const before = sequenceFlows(open.incoming);
    const after = sequenceFlows(open.outgoing);
    const { left, right, bottom, top } = extentOf(put.fragment);
    this.makeRoom(open, true, right - left - open.width, bottom, top);
    const drawn = this.draw(put, { x: open.x - left, y: centre(open).y }, null, after);
    for (const flow of before) {
      this.modeling.reconnectEnd(flow as never, drawn as never, centre(drawn));
    }
    this.modeling.removeShape(open as never);
    put.result = drawn;
  }

  private putBehind(put: Put, source: Shape): void {
    // Of a gateway, each branch is a way of its own: the fragment begins a new one.
    const isGateway = isA(source.businessObject as ModdleElement, "bpmn:Gateway");
    const after = isGateway ? [] : sequenceFlows(source.outgoing);
    const { left, right, bottom } = extentOf(put.fragment);
    if (after.length) this.makeRoom(source, true, right - left + DISTANCE, bottom);
    const { x, y } = centre(source);
    const position = { x: x + source.width / 2 + DISTANCE - left, y };
    put.result = this.draw(put, position, null, after);
    this.modeling.connect(source as never, put.result as never, { type: "bpmn:SequenceFlow" } as never);
  }

  /** Moves what is right of an element, and what is below it where the new one will reach. */
  private makeRoom(at: Shape, isBetween: boolean, width: number, bottom: number, top = 0): void {
    const right = at.x + at.width;
    if (isBetween && width > 0) this.space("x", width, right + 1);
    const middle = at.y + at.height / 2;
    const above = -top - at.height / 2;
    if (above > 0) this.space("y", above, at.y - 1);
    const low = at.y + at.height + Math.max(0, above);
    const wanted: Box = { x: at.x, y: low, width: width + at.width, height: middle + bottom - low };
    if (wanted.height <= 0) return;
    const inTheWay = this.shapes().filter((each) => overlap(each, wanted) && !contains(each, at));
    const highest = Math.min(...inTheWay.map(({ y }) => y));
    const missing = wanted.y + wanted.height + MARGIN - highest;
    if (inTheWay.length && missing > 0) this.space("y", missing, Math.max(low, highest - 1));
  }

  private shapes(): Shape[] {
    const all: Shape[] = [];
    const visit = (each: Shape & { children?: Shape[]; waypoints?: unknown; labelTarget?: unknown }) => {
      if (!each.waypoints && !each.labelTarget && each.width) all.push(each);
      for (const child of each.children ?? []) visit(child);
    };
    visit(this.canvas.getRootElement() as never);
    return all;
  }

  private space(axis: "x" | "y", by: number, from: number): void {
    const delta = axis === "x" ? { x: by, y: 0 } : { x: 0, y: by };
    const { movingShapes, resizingShapes } = this.spaceTool.calculateAdjustments(
      this.shapes(),
      axis,
      by,
      from,
    );
    if (movingShapes.length + resizingShapes.length === 0) return;
    const direction = axis === "x" ? "e" : "s";
    this.spaceTool.makeSpace(movingShapes, resizingShapes, delta, direction, from);
  }

  /** Draws it around a place; flows that led on from there begin at its exit. */
  private draw(
    { fragment, parent }: Put,
    { x, y }: { x: number; y: number },
    host: Shape | null,
    after: readonly Flow[] = [],
  ): Shape {
    const parts = new FragmentParts(this.factory, this.elementFactory, () =>
      this.modeler.getDefinitions(),
    );
    const drawn = new Map<string, Shape>();
    if (host) drawn.set(HOST, host);
    for (const node of fragment.nodes) {
      const at = { x: Math.round(x + node.at[0]), y: Math.round(y + node.at[1]) };
      const on = node.on && drawn.get(node.on);
      const into = on || (node.in && drawn.get(node.in)) || parent;
      const hints = on ? { attach: true } : {};
      const made = this.modeling.createShape(parts.shape(node) as never, at, into as never, hints);
      drawn.set(node.id, made as unknown as Shape);
    }
    const exit = drawn.get(fragment.exit)!;
    for (const flow of after) {
      this.modeling.reconnectStart(flow as never, exit as never, centre(exit));
    }
    for (const flow of fragment.flows) {
      const [from, to] = [drawn.get(flow.from)!, drawn.get(flow.to)!];
      const connection = this.modeling.createConnection(
        from as never,
        to as never,
        parts.flow(flow, centre(drawn.get(fragment.entry)!)) as never,
        from.parent as never,
      );
      if (flow.isDefault) {
        const { businessObject } = connection as unknown as Flow;
        this.modeling.updateProperties(from as never, { default: businessObject });
      }
    }
    return drawn.get(fragment.entry)!;
  }
}

export class Fragments {
  static readonly $inject = ["commandStack", "selection", "canvas", "eventBus"];
  private next: Element | undefined;

  constructor(
    private readonly commandStack: CommandStack,
    private readonly selection: Selection,
    private readonly canvas: Canvas,
    eventBus: EventBus,
  ) {
    commandStack.registerHandler(PUT, PutHandler as never);
    // What is dragged is one open place; the fragment takes it in the step in which it is let go.
    for (const command of ["elements.create", "shape.append"]) {
      eventBus.on(`commandStack.${command}.postExecuted`, ({ context }: { context: Created }) => {
        const shapes = context.elements ?? (context.shape ? [context.shape] : []);
        for (const shape of shapes) this.replaceDragged(shape);
      });
    }
    eventBus.on("create.end", AFTER_SELECTION, () => {
      if (this.next) this.selection.select(this.next as never);
      this.next = undefined;
    });
  }

  private replaceDragged(shape: Dragged): void {
    const fragment = shape.m2Fragment;
    delete shape.m2Fragment;
    if (fragment) this.next = this.execute(fragment, shape);
  }

  /** Behind an element, in an open place, or on an activity. */
  put(fragment: Fragment, at: Element): void {
    this.show(this.execute(fragment, at as Shape));
  }

  /** Where nothing is. */
  putAt(fragment: Fragment, position: { x: number; y: number }, parent: Element): void {
    const put: Put = { fragment, at: null, position, parent: parent as Shape };
    this.show(this.run(put));
  }

  private show(next: Shape): void {
    this.selection.select(next as never);
    const { width, height, scale, inner } = this.canvas.viewbox();
    const fitted = scale * Math.min(width / inner.width, height / inner.height);
    if (fitted < scale && fitted > LEAST_SCALE) return fitTo(this.canvas);
    this.canvas.scrollToElement(next as never, { top: 100, bottom: 100, left: 120, right: 200 });
  }

  private execute(fragment: Fragment, at: Shape): Shape {
    return this.run({ fragment, at, position: centre(at), parent: at.parent });
  }

  /** The next thing to do: say what is done in the first open place. */
  private run(put: Put): Shape {
    const before = new Set(openPlaces(put.parent));
    this.commandStack.execute(PUT, put);
    const made = openPlaces(put.parent).filter((each) => !before.has(each));
    const [first] = made.sort((one, other) => one.x - other.x || one.y - other.y);
    return first ?? put.result!;
  }
}

interface Created {
  elements?: Dragged[];
  shape?: Dragged;
}

type Dragged = Shape & { m2Fragment?: Fragment };

function openPlaces(parent: Shape & { children?: Shape[] }): Shape[] {
  return (parent.children ?? []).flatMap((each) => [
    ...(isOpen(each) ? [each] : []),
    ...openPlaces(each),
  ]);
}

const isDrawnBy = ({ nodes }: Fragment): boolean => nodes.some(({ id }) => id === HOST);

const sequenceFlows = (flows: readonly Flow[]): Flow[] =>
  flows.filter((each) => isA(each.businessObject as ModdleElement, "bpmn:SequenceFlow"));

function contains(outer: Shape, inner: Shape): boolean {
  for (let at: Shape | undefined = inner; at; at = at.parent) if (at === outer) return true;
  return false;
}
