// The side panels of the editor, and what they may ask of it.
import type { ReadonlySignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import type { Catalogue } from "../session/catalogue";
import type { Checks } from "../session/checks";
import type { MapPlan } from "../map/plan";
import type { Element, Services } from "../session/services";

/** A tab beside the canvas. It stays mounted while another tab is shown. */
export interface Panel {
  readonly id: string;
  readonly title: string;
  /** A number beside the title; 0 shows none. */
  badge?(editor: EditorContext): number;
  render(editor: EditorContext): ComponentChildren;
}

export interface EditorContext {
  /** Its name in the missions folder. */
  readonly mission: string;
  readonly catalogue: Catalogue;
  readonly checks: Checks;
  readonly plan: MapPlan;
  readonly selected: ReadonlySignal<readonly Element[]>;
  /** Counts changes, undone and redone ones too: what was found for an older count may be stale. */
  readonly changes: ReadonlySignal<number>;
  readonly isDirty: ReadonlySignal<boolean>;
  /** Whether the mission is drawn. Before that there is nothing to check, to rehearse or to start. */
  readonly isOpen: ReadonlySignal<boolean>;

  /** The mission as it is drawn now. */
  xml(): Promise<string>;
  service<Name extends keyof Services>(name: Name): Services[Name];

  /** Selects an element and scrolls to it, in whatever diagram; false: it is not drawn. */
  select(element: string): Promise<boolean>;

  /** Puts CSS classes on elements, by id, in place of those that the same layer put before. */
  mark(layer: string, classes: Readonly<Record<string, string>>): void;

  /** Saves, where there is something to save; false: it is not saved. */
  save(): Promise<boolean>;
}
