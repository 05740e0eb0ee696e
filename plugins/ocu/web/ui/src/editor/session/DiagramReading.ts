// The diagram for screen readers: each element has its name, kind and state, and the one that Tab
// has come to is said.
import { effect } from "@preact/signals";
import { described, nameSymbol } from "../../shared/elementNames";
import { counted, strings } from "../../strings";
import type { Checks } from "./checks";
import type { Marks } from "./marks";
import type { MissionModeler } from "./modeler";
import type { Element } from "./services";

const words = strings.editor.reading;
const SELECTED = "m2-selected-symbol";
/** All are named again after a change; what is typed or dragged changes faster than it is read. */
const PAUSE_MS = 200;

export class DiagramReading {
  private readonly svg: SVGElement;
  private readonly end: () => void;
  private timer: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly modeler: MissionModeler,
    private readonly checks: Checks,
    private readonly marks: Marks,
  ) {
    this.svg = modeler.get("canvas").getContainer().querySelector(":scope > svg")!;
    this.svg.setAttribute("role", "application");
    this.svg.setAttribute("aria-label", words.diagram);
    for (const event of ["import.done", "root.set", "commandStack.changed"]) {
      modeler.on(event, () => this.soon());
    }
    modeler.on("selection.changed", ({ newSelection }: { newSelection: Element[] }) =>
      this.point(newSelection),
    );
    this.end = effect(() => {
      checks.findings.value;
      marks.changes.value;
      this.soon();
    });
  }

  dispose(): void {
    this.end();
    clearTimeout(this.timer);
  }

  private soon(): void {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.nameAll(), PAUSE_MS);
  }

  private nameAll(): void {
    this.modeler.get("elementRegistry").forEach((element, gfx) => {
      if (!element.parent) return; // the plane on which the others are
      if ("labelTarget" in element && element.labelTarget) gfx.setAttribute("aria-hidden", "true");
      else nameSymbol(gfx, described(element, this.statesOf(element.id)));
    });
  }

  private statesOf(id: string): string[] {
    const problems = this.checks.of(id).length;
    const states: Readonly<Record<string, string>> = words.states;
    return [
      ...this.marks.classesOf(id).flatMap((name) => states[name] ?? []),
      problems > 0 ? counted(words.problems, problems) : "",
    ];
  }

  /** The canvas has the focus; what is selected is what it is at. */
  private point(selected: readonly Element[]): void {
    this.svg.querySelector(`#${SELECTED}`)?.removeAttribute("id");
    const [element] = selected;
    const symbol = element && this.modeler.get("elementRegistry").getGraphics(element as never);
    if (!symbol || selected.length > 1) return this.svg.removeAttribute("aria-activedescendant");
    nameSymbol(symbol, described(element, this.statesOf(element.id)));
    symbol.id = SELECTED;
    this.svg.setAttribute("aria-activedescendant", SELECTED);
  }
}
