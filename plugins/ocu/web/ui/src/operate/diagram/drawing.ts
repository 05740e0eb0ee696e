// One diagram of a file as bpmn-js draws it, with the states of its elements.
import NavigatedViewer from "bpmn-js/lib/NavigatedViewer";
import type Canvas from "diagram-js/lib/core/Canvas";
import type ElementRegistry from "diagram-js/lib/core/ElementRegistry";
import type EventBus from "diagram-js/lib/core/EventBus";
import type { ElementLike, RootLike, ShapeLike } from "diagram-js/lib/core/Types";
import type { Point } from "diagram-js/lib/util/Types";
import { described, nameSymbol } from "../../shared/elementNames";
import type { ElementState } from "../../shared/types";
import { strings } from "../../strings";
import { processOf, type Element } from "../mission/moddle";
import { keyIn, keyOf, qualified } from "../mission/names";
import type { Marks } from "../debug/breakpoints";
import type { Violations } from "../requirements/violations";
import { Badges, type Badged } from "./badges";
import { lookOf, type Look, type Palette } from "./colours";
import { Painter, type Outline, type Window } from "./painter";
import { statesOf } from "./spoken";

interface Figure extends Badged {
  id: string;
  root: RootLike | undefined;
  look: Look;
  left_ms: number;
}

export interface DrawingListener {
  chosen(process: string, element: string): void;
  /** The user asked for the menu at an element, at a place in the window. */
  menu(process: string, element: string, x: number, y: number): void;
  /** The user went into or out of a collapsed subprocess. */
  wentTo(root: string): void;
}

/** The middle of what is seen; its type does not know that. */
const MIDDLE = "auto" as unknown as Point;

/** Small diagrams are not blown up more. */
const LARGEST = 1.2;

const LOOKS: Look[] = ["active", "asking", "waiting", "failed", "done"];

export class Drawing {
  private readonly figures = new Map<string, Figure>();
  private root: RootLike | undefined;
  /** Nobody has moved it since it was fitted: then it is fitted again when its pane changes. */
  private fits = false;
  private fitting = false;
  private selected: Figure | undefined;
  private surrounded: readonly Figure[] = [];
  private readonly badges = new Badges();
  private readonly observer: ResizeObserver;

  private constructor(
    private readonly viewer: NavigatedViewer,
    private readonly host: HTMLElement,
    private readonly painter: Painter,
    qualifier: string,
    listener: DrawingListener,
  ) {
    this.index(qualifier);
    this.root = this.canvas.getRootElement();
    this.paintAll();
    const bus = viewer.get<EventBus>("eventBus");
    bus.on("canvas.viewbox.changing", () => this.follow());
    bus.on("canvas.viewbox.changed", () => this.follow());
    bus.on("root.set", () => {
      this.root = this.canvas.getRootElement();
      this.paintAll();
      listener.wentTo(this.root.id);
    });
    bus.on<{ element: ElementLike }>("element.click", ({ element }) => {
      const about = element.businessObject as Element | undefined;
      if (!about?.$instanceOf("bpmn:FlowNode")) return;
      listener.chosen(qualified(qualifier, processOf(about)), qualified(qualifier, about.id));
    });
    bus.on<{ element: ElementLike; originalEvent: MouseEvent }>(
      "element.contextmenu",
      ({ element, originalEvent }) => {
        const about = element.businessObject as Element | undefined;
        if (!about?.$instanceOf("bpmn:FlowNode")) return;
        originalEvent.preventDefault();
        const { clientX, clientY } = originalEvent;
        const process = qualified(qualifier, processOf(about));
        listener.menu(process, qualified(qualifier, about.id), clientX, clientY);
      },
    );
    this.observer = new ResizeObserver(() => this.resized());
    this.observer.observe(host);
  }

  static async open(
    host: HTMLElement,
    file: { xml: string; qualifier: string },
    diagram: string,
    palette: Palette,
    fading_ms: number,
    listener: DrawingListener,
  ): Promise<Drawing> {
    const viewer = new NavigatedViewer({ container: host });
    await viewer.importXML(file.xml, diagram);
    const svg = host.querySelector(".djs-container > svg")!;
    svg.setAttribute("role", "graphics-document");
    svg.setAttribute("aria-label", strings.operate.panes.diagram);
    const canvas = document.createElement("canvas");
    canvas.className = "glow";
    host.querySelector(".djs-container")!.append(canvas);
    const painter = new Painter(canvas, { x: 0, y: 0, scale: 1 }, palette, fading_ms);
    const drawing = new Drawing(viewer, host, painter, file.qualifier, listener);
    drawing.resized();
    drawing.fit();
    return drawing;
  }

  dispose(): void {
    this.observer.disconnect();
    this.badges.dispose();
    this.painter.dispose();
    this.viewer.destroy();
  }

  show(palette: Palette, fading_ms: number): void {
    this.painter.show(palette, fading_ms);
  }

  /** Which of the roots in this drawing is seen: the diagram, or the inside of a subprocess. */
  enter(root: string): void {
    if (this.root?.id === root) return;
    const found = this.canvas.getRootElements().find(({ id }) => id === root);
    if (!found) return;
    this.canvas.setRootElement(found);
    this.fit();
  }

  fit(): void {
    if (this.host.clientWidth === 0 || this.host.clientHeight === 0) return;
    this.fitting = true;
    this.canvas.zoom("fit-viewport", MIDDLE);
    const { scale } = this.canvas.viewbox();
    this.canvas.zoom(Math.min(LARGEST, scale * 0.97), MIDDLE);
    this.fitting = false;
    this.fits = true;
  }

  zoom(factor: number): void {
    this.canvas.zoom(this.canvas.zoom() * factor, MIDDLE);
  }

  /** `age_ms`: how long ago an element was left, for one that is shown late. */
  set(
    process: string,
    element: string,
    state: ElementState,
    passed: boolean,
    age_ms: number,
  ): void {
    const figure = this.figures.get(keyOf(process, element));
    if (!figure) return;
    const look = lookOf(state);
    // What came and went between two frames is seen fading, at least.
    if (look === "done" && (passed || figure.look !== "done")) {
      figure.left_ms = performance.now() - age_ms;
    }
    if (look !== figure.look) this.mark(figure, look);
    this.badges.set(figure, state);
    this.paint(figure);
  }

  select(process: string, element: string, scroll: boolean): void {
    this.selected = this.figures.get(keyOf(process, element));
    if (this.selected && scroll) this.canvas.scrollToElement(this.selected.id, 60);
    this.showSelected();
  }

  /** Mark the elements of requirements that are violated. */
  violate(violations: Violations): void {
    this.badges.violate(this.figures, violations);
  }

  /** Mark the elements with breakpoints, and the one before which the run is stopped. */
  debug(marks: Marks): void {
    this.badges.mark(this.figures, marks);
  }

  /** Draw a line around elements, beside that around the one that is selected. */
  surround(keys: readonly string[]): void {
    this.surrounded = keys.flatMap((key) => this.figures.get(key) ?? []);
    this.showSelected();
  }

  unselect(): void {
    this.selected = undefined;
    this.showSelected();
  }

  private get canvas(): Canvas {
    return this.viewer.get<Canvas>("canvas");
  }

  private index(qualifier: string): void {
    const registry = this.viewer.get<ElementRegistry>("elementRegistry");
    registry.forEach((element, gfx) => {
      const about = element.businessObject as Element | undefined;
      if (!about || !element.parent) return;
      if (element.type === "label") return gfx.setAttribute("aria-hidden", "true");
      const name = described(element);
      if (!isShape(element) || !about.$instanceOf("bpmn:FlowNode")) return nameSymbol(gfx, name);
      nameSymbol(gfx, [name, ...statesOf(undefined)].join(", "));
      const key = keyIn(qualifier, about);
      const root = this.canvas.findRoot(element);
      const outline = outlineOf(element, about);
      const { id } = element;
      this.figures.set(key, { key, id, name, root, outline, gfx, look: "idle", left_ms: 0 });
    });
  }

  private mark(figure: Figure, look: Look): void {
    for (const other of LOOKS) figure.gfx.classList.toggle(`m2-${other}`, other === look);
    figure.look = look;
  }

  private paint({ key, root, outline, look, left_ms }: Figure): void {
    if (root === this.root) this.painter.set(key, { outline, look, left_ms });
  }

  private paintAll(): void {
    const figures = [...this.figures.values()].filter(({ root }) => root === this.root);
    this.painter.clear(figures.map(({ outline }) => outline).filter(({ above }) => above));
    for (const figure of figures) this.paint(figure);
    this.showSelected();
  }

  private showSelected(): void {
    const isSeen = this.selected?.root === this.root;
    const others = this.surrounded.filter(({ root }) => root === this.root);
    this.painter.select(
      isSeen ? this.selected?.outline : undefined,
      others.map(({ outline }) => outline),
    );
  }

  private follow(): void {
    const { x, y, scale } = this.canvas.viewbox() as Window;
    this.painter.look({ x, y, scale });
    this.badges.zoom(this.host, scale);
    this.fits &&= this.fitting;
  }

  private resized(): void {
    const { clientWidth, clientHeight } = this.host;
    if (clientWidth === 0 || clientHeight === 0) return;
    const fitted = this.fits;
    this.canvas.resized();
    this.painter.resize(clientWidth, clientHeight);
    if (fitted) this.fit();
    else this.follow();
  }
}

const isShape = (element: ElementLike): element is ShapeLike =>
  !("waypoints" in element) && element.type !== "label" && "width" in element;

function outlineOf(shape: ShapeLike, about: Element): Outline {
  const { x = 0, y = 0, width = 0, height = 0 } = shape;
  const above = about.$instanceOf("bpmn:BoundaryEvent");
  return { x, y, width, height, kind: kindOf(shape, about), above };
}

function kindOf(shape: ShapeLike, about: Element): Outline["kind"] {
  if (about.$instanceOf("bpmn:Event")) return "circle";
  if (about.$instanceOf("bpmn:Gateway")) return "diamond";
  return about.$instanceOf("bpmn:SubProcess") && !shape.collapsed ? "frame" : "box";
}
