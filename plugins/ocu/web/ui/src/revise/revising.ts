// Which run is to be revised, and which versions of a run are listed; null and "": the dialog is
// closed. It stays open when the page of the run is drawn again, as for a revision by another
// operator.
import { signal } from "@preact/signals";
import type { NewVersion } from "./plan";

export interface Revising {
  run: string;
  /** What it is to go on with; null: the operator chooses. */
  version: NewVersion | null;
}

export const revising = signal<Revising | null>(null);

export const listingVersions = signal("");
