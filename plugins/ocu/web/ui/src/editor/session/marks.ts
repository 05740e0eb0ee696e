// CSS classes on elements of the canvas, by layers that know nothing of each other.
import { signal } from "@preact/signals";
import type { MissionModeler } from "./modeler";

export class Marks {
  /** Counts them. */
  readonly changes = signal(0);
  private readonly layers = new Map<string, Readonly<Record<string, string>>>();
  private readonly shown = new Map<string, [id: string, name: string][]>();

  constructor(private readonly modeler: MissionModeler) {}

  set(layer: string, classes: Readonly<Record<string, string>>): void {
    this.layers.set(layer, classes);
    this.show(layer);
    this.changes.value = this.changes.peek() + 1;
  }

  classesOf(id: string): string[] {
    return [...this.layers.values()].flatMap((classes) => classes[id]?.split(" ") ?? []);
  }

  /** Another diagram is drawn. */
  refresh(): void {
    for (const layer of this.layers.keys()) this.show(layer);
  }

  private show(layer: string): void {
    const canvas = this.modeler.get("canvas");
    const registry = this.modeler.get("elementRegistry");
    for (const [id, name] of this.shown.get(layer) ?? []) {
      if (registry.get(id)) canvas.removeMarker(id, name);
    }
    const drawn = Object.entries(this.layers.get(layer) ?? {})
      .filter(([id]) => registry.get(id))
      .flatMap(([id, names]) => names.split(" ").map((name): [string, string] => [id, name]));
    for (const [id, name] of drawn) canvas.addMarker(id, name);
    this.shown.set(layer, drawn);
  }
}
