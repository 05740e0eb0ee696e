// The drawings of a mission: made when they are first shown, and kept.
import type { MissionModel } from "../mission/missionModel";
import type { View } from "../mission/views";
import type { Place } from "../context";
import { keyOf } from "../mission/names";
import { marksIn, type Marks } from "../debug/breakpoints";
import { violationsIn, type Violations } from "../requirements/violations";
import type { ElementChange } from "../scene/elementBoard";
import type { Scene } from "../scene/scene";
import { fading_ms, palette } from "./colours";
import { Drawing } from "./drawing";

export interface DrawingsListener {
  chosen(process: string, element: string): void;
  menu(process: string, element: string, x: number, y: number): void;
  wentTo(view: View): void;
}

export class Drawings {
  private readonly drawings = new Map<string, Promise<Drawing>>();
  private readonly made = new Map<string, Drawing>();
  private readonly stops: (() => void)[] = [];
  private violations: Violations = new Map();
  private marks: Marks = new Map();
  private surrounded: readonly string[] = [];
  private shown: View | undefined;
  private over = false;

  constructor(
    private readonly host: HTMLElement,
    private readonly mission: MissionModel,
    private readonly scene: Scene,
    private readonly listener: DrawingsListener,
  ) {
    const recolour = () => {
      for (const drawing of this.made.values()) drawing.show(palette.value, fading_ms.value);
    };
    this.stops.push(
      scene.elements.listen((changes) => this.apply(changes)),
      palette.subscribe(recolour),
      fading_ms.subscribe(recolour),
      scene.requirements.subscribe((requirements) => {
        this.violations = violationsIn(requirements, mission);
        for (const drawing of this.made.values()) drawing.violate(this.violations);
      }),
      scene.debugging.subscribe((debugging) => {
        this.marks = marksIn(debugging, mission);
        for (const drawing of this.made.values()) drawing.debug(this.marks);
      }),
    );
  }

  dispose(): void {
    this.over = true;
    for (const stop of this.stops) stop();
    for (const drawing of this.made.values()) drawing.dispose();
    this.host.replaceChildren();
  }

  async show(key: string): Promise<void> {
    const view = this.mission.views.find((each) => each.key === key);
    if (!view) return;
    this.shown = view;
    const drawing = await this.drawingOf(view);
    if (this.over || this.shown !== view) return;
    for (const box of this.host.children) box.toggleAttribute("hidden", box.id !== idOf(view));
    drawing.enter(view.root);
  }

  async select(place: (Place & { show: boolean }) | null): Promise<void> {
    for (const drawing of this.made.values()) drawing.unselect();
    const view = place && this.mission.viewOf(place.process, place.element);
    if (!view) return;
    const drawing = await this.drawingOf(view);
    drawing.select(place.process, place.element, place.show);
  }

  surround(places: readonly Place[]): void {
    this.surrounded = places.map(({ process, element }) => keyOf(process, element));
    for (const drawing of this.made.values()) drawing.surround(this.surrounded);
  }

  fit(): void {
    this.current?.fit();
  }

  zoom(factor: number): void {
    this.current?.zoom(factor);
  }

  private get current(): Drawing | undefined {
    return this.shown && this.made.get(idOf(this.shown));
  }

  private drawingOf(view: View): Promise<Drawing> {
    const id = idOf(view);
    let drawing = this.drawings.get(id);
    if (!drawing) this.drawings.set(id, (drawing = this.open(id, view)));
    return drawing;
  }

  private async open(id: string, view: View): Promise<Drawing> {
    const box = document.createElement("div");
    box.id = id;
    box.className = "drawing";
    for (const other of this.host.children) other.toggleAttribute("hidden", true);
    this.host.append(box);
    const file = this.mission.files[view.file]!;
    const drawing = await Drawing.open(box, file, view.diagram, palette.value, fading_ms.value, {
      chosen: this.listener.chosen,
      menu: this.listener.menu,
      wentTo: (root) => {
        const found = this.mission.views.find((each) => each.root === root && idOf(each) === id);
        if (found) this.listener.wentTo(found);
      },
    });
    if (this.over) drawing.dispose();
    else this.made.set(id, drawing);
    for (const [process, element, state] of this.scene.elements.all()) {
      drawing.set(process, element, state, false, this.age_ms(state.last));
    }
    drawing.violate(this.violations);
    drawing.debug(this.marks);
    drawing.surround(this.surrounded);
    return drawing;
  }

  private apply(changes: ElementChange[]): void {
    for (const { process, element, state, before } of changes) {
      const passed = before !== undefined && state.hits > before.hits;
      const age_ms = this.age_ms(state.last);
      for (const drawing of this.made.values())
        drawing.set(process, element, state, passed, age_ms);
    }
  }

  private age_ms(last: number): number {
    return (Math.max(0, this.scene.now() - last) / Math.max(1, this.scene.pace.value)) * 1000;
  }
}

const idOf = ({ file, diagram }: View): string => `drawing-${file}-${diagram}`;
