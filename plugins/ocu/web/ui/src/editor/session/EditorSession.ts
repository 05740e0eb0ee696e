// One mission that is being drawn: the modeler, and what the page shows of its state.
import { signal } from "@preact/signals";
import { post } from "../../shared/api";
import type { Check } from "../../shared/types";
import { MapPlan } from "../map/plan";
import { geometriesOf } from "../moddle/geometries";
import type { ModdleElement } from "../moddle/moddle";
import type { EditorContext } from "../panels/panel";
import type { Catalogue } from "./catalogue";
import { Checks } from "./checks";
import { DiagramReading } from "./DiagramReading";
import { Diagrams } from "./diagrams";
import { fitTo } from "./fitting";
import { Locator } from "./Locator";
import { Marks } from "./marks";
import { makeModeler, type MissionModeler } from "./modeler";
import { followPalette } from "./paletteFocus";
import type { Element, Services } from "./services";

/** Stands for the last change where there is none. */
const BEGINNING = {};

export class EditorSession implements EditorContext {
  readonly modeler: MissionModeler;
  readonly checks: Checks;
  readonly diagrams: Diagrams;
  readonly changes = signal(0);
  readonly isDirty = signal(false);
  readonly isOpen = signal(false);
  readonly canUndo = signal(false);
  readonly canRedo = signal(false);
  readonly selected = signal<readonly Element[]>([]);
  readonly warnings = signal<readonly string[]>([]);
  readonly plan: MapPlan;
  private readonly locator: Locator;
  private readonly marks: Marks;
  private readonly reading: DiagramReading;
  private readonly leavePalette: () => void;
  /** The last change when the mission was saved; null: what is saved is not on the command stack. */
  private savedAt: object | null = BEGINNING;

  constructor(
    readonly mission: string,
    readonly catalogue: Catalogue,
    private readonly saving: () => Promise<boolean>,
  ) {
    this.modeler = makeModeler(catalogue, { editorContext: ["value", this] });
    this.checks = new Checks(
      () => this.xml(),
      (xml) => post<Check>("/checks", { xml, mission }),
    );
    this.diagrams = new Diagrams(this.modeler, () => this.detachFromStack());
    this.plan = new MapPlan(this);
    this.locator = new Locator(this.modeler, this.diagrams);
    this.marks = new Marks(this.modeler);
    this.leavePalette = followPalette(this.service("canvas").getContainer());
    this.reading = new DiagramReading(this.modeler, this.checks, this.marks);
    this.follow();
  }

  private follow(): void {
    this.modeler.on("commandStack.changed", () => this.stackChanged());
    this.modeler.on("selection.changed", ({ newSelection }: { newSelection: Element[] }) => {
      this.selected.value = newSelection;
    });
    this.modeler.on("import.done", () => {
      this.diagrams.refresh();
      this.showFindings();
    });
    this.modeler.on("root.set", () => {
      this.diagrams.refresh();
      this.showFindings();
    });
    this.checks.findings.subscribe(() => this.showFindings());
  }

  /** Draws a mission. `isSaved`: whether it is what the server has. */
  async open(xml: string, isSaved: boolean): Promise<void> {
    const { warnings } = await this.modeler.importXML(xml);
    this.warnings.value = warnings.map(String);
    this.savedAt = isSaved ? BEGINNING : null;
    this.stackChanged();
    this.isOpen.value = true;
    this.fit();
  }

  async xml(): Promise<string> {
    const { xml, error } = await this.modeler.saveXML({ format: true });
    if (xml === undefined) throw error ?? new Error("the mission could not be written");
    return xml;
  }

  service<Name extends keyof Services>(name: Name): Services[Name] {
    return this.modeler.get(name);
  }

  async select(element: string): Promise<boolean> {
    return this.locator.show(element);
  }

  mark(layer: string, classes: Readonly<Record<string, string>>): void {
    this.marks.set(layer, classes);
  }

  save(): Promise<boolean> {
    return this.saving();
  }

  /** What is drawn now is what the server has. */
  saved(): void {
    this.savedAt = this.lastChange();
    this.isDirty.value = false;
  }

  fit(): void {
    fitTo(this.service("canvas"));
  }

  end(): void {
    this.checks.end();
    this.reading.dispose();
    this.leavePalette();
    this.modeler.destroy();
  }

  private stackChanged(): void {
    const stack = this.service("commandStack");
    this.canUndo.value = stack.canUndo();
    this.canRedo.value = stack.canRedo();
    this.isDirty.value = this.lastChange() !== this.savedAt;
    this.catalogue.own.value = geometriesOf(this.modeler.getDefinitions() as ModdleElement);
    this.changes.value += 1;
    this.diagrams.refresh();
    this.checks.soon();
  }

  /** Another diagram is about to be drawn in place of these, with a command stack of its own. */
  private detachFromStack(): void {
    this.savedAt = this.isDirty.value ? null : BEGINNING;
  }

  /** Not its number: after an undo, another change may have that. */
  private lastChange(): object {
    const { _stack, _stackIdx } = this.service("commandStack") as unknown as {
      _stack: object[];
      _stackIdx: number;
    };
    return _stack[_stackIdx] ?? BEGINNING;
  }

  private showFindings(): void {
    const marks = this.modeler.get("findingMarks");
    marks.show(this.checks.findings.value, (element) => void this.select(element));
    this.marks.refresh();
  }
}
