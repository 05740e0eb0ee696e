// The run that is to be revised; "": the dialog is closed. It stays open when the page of the run
// is drawn again, as for a revision by another operator.
import { signal } from "@preact/signals";

export const revising = signal("");
