// The diagrams of a file: one a process or collaboration; those of collapsed subprocesses open from
// within them.
import { signal } from "@preact/signals";
import { list, text, type ModdleElement } from "../moddle/moddle";
import { fitTo } from "./fitting";
import type { MissionModeler } from "./modeler";
import { draws, isOutermost, outermostOf, ownerOf } from "./planes";
import type { Canvas } from "./services";

export interface Diagram {
  id: string;
  title: string;
  /** Of the process or collaboration. */
  owner: string;
}

type Root = ReturnType<Canvas["getRootElement"]>;

export class Diagrams {
  readonly all = signal<readonly Diagram[]>([]);
  readonly current = signal("");
  private readonly seen = new WeakSet<Root>();

  constructor(
    private readonly modeler: MissionModeler,
    private readonly beforeReplacing: () => void,
  ) {}

  /** What is drawn or shown has changed, or a name has. */
  refresh(): void {
    if (!this.definitions()) return;
    this.all.value = this.elements().map((diagram) => {
      const owner = ownerOf(diagram)!;
      return { id: text(diagram, "id"), title: titleOf(diagram, owner), owner: text(owner, "id") };
    });
    const root = this.modeler.get("canvas").getRootElement();
    const own = this.all.value.find(({ id }) => id === diagramOf(root));
    const outermost = outermostOf(root.businessObject as ModdleElement);
    const shown = own ?? this.all.value.find(({ owner }) => owner === outermost);
    if (shown) this.current.value = shown.id;
  }

  async open(id: string): Promise<void> {
    if (id === this.current.value) return;
    const canvas = this.modeler.get("canvas");
    const root = this.rootOf(id);
    this.seen.add(canvas.getRootElement());
    if (root) canvas.setRootElement(root);
    else {
      this.beforeReplacing();
      await this.modeler.open(id);
      this.refresh();
    }
    if (!root || !this.seen.has(root)) fitTo(canvas);
  }

  /** The diagram on which an element is drawn, or that of the process around it. */
  of(element: string): Diagram | undefined {
    const found = this.elements().find((diagram) => draws(diagram, element));
    if (found) return this.all.value.find(({ id }) => id === text(found, "id"));
    const inner = list(this.definitions(), "diagrams").find((diagram) => draws(diagram, element));
    const owner = inner && ownerOf(inner);
    if (!owner) return this.all.value.find((each) => each.owner === element);
    const outermost = outermostOf(owner);
    return this.all.value.find((each) => each.owner === outermost);
  }

  /** An empty process with a diagram of its own. */
  add(name: string): void {
    this.modeler.get("processes").add(this.definitions(), name);
  }

  /** Whether something else is drawn that can be shown without it. */
  isRemovable(id: string): boolean {
    return this.otherThan(id) !== undefined;
  }

  /** Removes what is shown: a process, or all processes of its pools. */
  remove(id: string): void {
    const other = this.otherThan(id);
    if (id !== this.current.value || !other) return;
    this.modeler.get("processes").remove(this.definitions(), other);
  }

  private otherThan(id: string): Root | undefined {
    const others = this.all.value.filter((each) => each.id !== id);
    return others.map((each) => this.rootOf(each.id)).find((root) => root);
  }

  private rootOf(diagram: string): Root | undefined {
    const roots = this.modeler.get("canvas").getRootElements() as Root[];
    return roots.find((root) => diagramOf(root) === diagram);
  }

  private definitions(): ModdleElement {
    return this.modeler.getDefinitions() as ModdleElement;
  }

  private elements(): ModdleElement[] {
    return list(this.definitions(), "diagrams").filter(isOutermost);
  }
}

function diagramOf(root: Root): string {
  const { di } = root as unknown as { di?: ModdleElement };
  return di?.$parent ? text(di.$parent, "id") : "";
}

function titleOf(diagram: ModdleElement, owner: ModdleElement): string {
  const pools = list(owner, "participants").map((each) => text(each, "name") || text(each, "id"));
  const own = text(owner, "name") || text(diagram, "name");
  return own || pools.join(", ") || text(owner, "id");
}
