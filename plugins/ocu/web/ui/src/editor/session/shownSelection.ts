// What is selected together is on the diagram that is shown: bpmn-js looks for "all" and for what
// is in a frame on the others as well.
import type { Canvas, Element, Selection } from "./services";

type Chosen = Element | Element[] | null;

export class ShownSelection {
  static readonly $inject = ["selection", "canvas"];

  constructor(selection: Selection, canvas: Canvas) {
    const select = selection.select.bind(selection) as (chosen: Chosen, add?: boolean) => void;
    const isShown = (element: Element) => canvas.findRoot(element) === canvas.getRootElement();
    const selectShown = (chosen: Chosen, add?: boolean) =>
      select(Array.isArray(chosen) ? chosen.filter(isShown) : chosen, add);
    selection.select = selectShown as typeof selection.select;
  }
}

export const shownSelectionModule = {
  __init__: ["shownSelection"],
  shownSelection: ["type", ShownSelection],
};
