// Two versions of a diagram as bpmn-js draws them, which are moved and zoomed together.
import NavigatedViewer from "bpmn-js/lib/NavigatedViewer";
import type Canvas from "diagram-js/lib/core/Canvas";
import type ElementRegistry from "diagram-js/lib/core/ElementRegistry";
import type EventBus from "diagram-js/lib/core/EventBus";
import type Overlays from "diagram-js/lib/features/overlays/Overlays";
import { m2pemDescriptor } from "../editor/moddle/descriptor";
import { child, isA, list, text, type ModdleElement } from "../editor/moddle/moddle";
import { strings } from "../strings";
import { changesOf, type ChangeKind, type ElementChange } from "./changes";

const { signs, kinds } = strings.compare;
const SELECTED = "cmp-selected";

/** Small diagrams are not blown up more. */
const LARGEST = 1.2;
const MARGIN = 40;

export interface DiagramChoice {
  /** The process or collaboration that is drawn. */
  id: string;
  label: string;
}

type Where = "before" | "after";

/** A diagram that is drawn here; "": this version has none of that process. */
class Half {
  readonly viewer: NavigatedViewer;
  diagrams = new Map<string, ModdleElement>();
  definitions!: ModdleElement;
  private selected = "";

  constructor(host: HTMLElement) {
    this.viewer = new NavigatedViewer({
      container: host,
      moddleExtensions: { m2pem: m2pemDescriptor },
    });
  }

  get canvas(): Canvas {
    return this.viewer.get<Canvas>("canvas");
  }

  async open(xml: string): Promise<void> {
    await this.viewer.importXML(xml);
    this.definitions = this.viewer.getDefinitions() as unknown as ModdleElement;
    for (const diagram of list(this.definitions, "diagrams")) {
      const plane = child(diagram, "plane");
      const drawn = plane && child(plane, "bpmnElement");
      if (drawn && (isA(drawn, "bpmn:Process") || isA(drawn, "bpmn:Collaboration"))) {
        this.diagrams.set(text(drawn, "id"), diagram);
      }
    }
  }

  async show(id: string): Promise<boolean> {
    const diagram = this.diagrams.get(id);
    if (!diagram) {
      this.viewer.clear();
      return false;
    }
    await this.viewer.open(diagram as never);
    return true;
  }

  mark(changes: readonly ElementChange[], where: Where): void {
    const registry = this.viewer.get<ElementRegistry>("elementRegistry");
    const overlays = this.viewer.get<Overlays>("overlays");
    for (const { id, kind } of changes) {
      if (kind === (where === "before" ? "added" : "removed") || !registry.get(id)) continue;
      const element = registry.get(id)!;
      this.canvas.addMarker(id, `cmp-${kind}`);
      if ("waypoints" in element || element.parent === undefined) continue;
      overlays.add(id, "compare", { position: { top: -12, left: -12 }, html: sign(kind) });
    }
  }

  /** Whether it is in the diagram that is shown. */
  select(id: string): boolean {
    const registry = this.viewer.get<ElementRegistry>("elementRegistry");
    if (this.selected && registry.get(this.selected)) {
      this.canvas.removeMarker(this.selected, SELECTED);
    }
    const element = registry.get(id);
    this.selected = element ? id : "";
    if (!element) return false;
    const root = this.canvas.findRoot(element);
    if (root) this.canvas.setRootElement(root);
    this.canvas.addMarker(id, SELECTED);
    return true;
  }
}

function sign(kind: ChangeKind): HTMLElement {
  const made = document.createElement("span");
  made.className = `cmp-sign cmp-sign-${kind}`;
  made.textContent = signs[kind];
  made.setAttribute("role", "img");
  made.setAttribute("aria-label", kinds[kind]);
  return made;
}

export class SideBySide {
  changes: ElementChange[] = [];
  private readonly halves: Record<Where, Half>;
  private readonly observer: ResizeObserver;
  private isFollowing = false;

  constructor(
    before: HTMLElement,
    after: HTMLElement,
    private readonly chosen: (id: string) => void,
  ) {
    this.halves = { before: new Half(before), after: new Half(after) };
    this.follow("before", "after");
    this.follow("after", "before");
    this.observer = new ResizeObserver(() => {
      for (const { canvas } of Object.values(this.halves)) canvas.resized();
    });
    this.observer.observe(before);
  }

  async open(before: string, after: string): Promise<DiagramChoice[]> {
    await this.halves.before.open(before);
    await this.halves.after.open(after);
    this.changes = changesOf(this.halves.before.definitions, this.halves.after.definitions);
    const { after: now, before: old } = this.halves;
    const all = new Map([...old.diagrams, ...now.diagrams]);
    return [...all].map(([id, diagram]) => {
      const drawn = child(child(diagram, "plane")!, "bpmnElement")!;
      const isNamed = isA(drawn, "bpmn:Process");
      return { id, label: (isNamed && text(drawn, "name")) || id };
    });
  }

  /** Shows a diagram in both; whether each of them has it. */
  async show(id: string): Promise<Record<Where, boolean>> {
    const { before, after } = this.halves;
    this.isFollowing = true;
    const has = { before: await before.show(id), after: await after.show(id) };
    if (has.before) before.mark(this.changes, "before");
    if (has.after) after.mark(this.changes, "after");
    this.isFollowing = false;
    this.fit();
    return has;
  }

  /** The diagram that has an element; "": none, as it is not drawn. */
  diagramOf(id: string): string {
    for (const { diagrams } of [this.halves.after, this.halves.before]) {
      for (const [process, diagram] of diagrams) {
        const planes = list(child(diagram, "plane"), "planeElement");
        const isDrawn = (each: ModdleElement) => {
          const drawn = child(each, "bpmnElement");
          return drawn !== undefined && text(drawn, "id") === id;
        };
        if (process === id || planes.some(isDrawn)) return process;
      }
    }
    return "";
  }

  select(id: string): void {
    const now = this.halves.after.select(id);
    const old = this.halves.before.select(id);
    const half = now ? this.halves.after : this.halves.before;
    if (now || old) half.canvas.scrollToElement(id, 80);
  }

  /** Both, about the middle of what is seen. */
  zoom(factor: number): void {
    const { canvas } = this.halves.after;
    canvas.zoom(canvas.zoom() * factor);
  }

  /** All that is drawn in one of both, in both. */
  fit(): void {
    const boxes = Object.values(this.halves).flatMap(({ canvas }) => {
      const { inner } = canvas.viewbox();
      return inner.width > 0 ? [inner] : [];
    });
    const { outer } = this.halves.after.canvas.viewbox();
    if (boxes.length === 0 || outer.width === 0) return;
    const left = Math.min(...boxes.map(({ x }) => x)) - MARGIN;
    const top = Math.min(...boxes.map(({ y }) => y)) - MARGIN;
    const right = Math.max(...boxes.map(({ x, width }) => x + width)) + MARGIN;
    const bottom = Math.max(...boxes.map(({ y, height }) => y + height)) + MARGIN;
    const scale = Math.min(outer.width / (right - left), outer.height / (bottom - top), LARGEST);
    const [width, height] = [outer.width / scale, outer.height / scale];
    const x = (left + right - width) / 2;
    const y = (top + bottom - height) / 2;
    this.halves.after.canvas.viewbox({ x, y, width, height });
    this.halves.before.canvas.viewbox({ x, y, width, height });
  }

  dispose(): void {
    this.observer.disconnect();
    for (const { viewer } of Object.values(this.halves)) viewer.destroy();
  }

  private follow(from: Where, to: Where): void {
    const { viewer, canvas } = this.halves[from];
    const bus = viewer.get<EventBus>("eventBus");
    bus.on("canvas.viewbox.changed", () => {
      if (this.isFollowing) return;
      this.isFollowing = true;
      const { x, y, width, height } = canvas.viewbox();
      this.halves[to].canvas.viewbox({ x, y, width, height });
      this.isFollowing = false;
    });
    bus.on<{ element: { id: string } }>("element.click", ({ element }) => {
      if (this.changes.some(({ id }) => id === element.id)) this.chosen(element.id);
    });
  }
}
