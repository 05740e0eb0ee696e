// Which versions of the mission of the editor are compared; null: none, the dialog is closed.
import { signal } from "@preact/signals";

/** A version by its number, or what is drawn in this editor and perhaps not saved. */
export type Side = number | "drawn";

export interface Comparing {
  before: Side;
  after: Side;
}

export const comparing = signal<Comparing | null>(null);
