// Which diagrams a file has, and what is drawn on them.
import { child, isA, list, text, type ModdleElement } from "../moddle/moddle";

/** The process, collaboration or subprocess that a diagram shows. */
export function ownerOf(diagram: ModdleElement): ModdleElement | undefined {
  const plane = child(diagram, "plane");
  return plane && child(plane, "bpmnElement");
}

/** Whether it shows a process or collaboration; the others open from within those. */
export function isOutermost(diagram: ModdleElement): boolean {
  const owner = ownerOf(diagram);
  return isA(owner, "bpmn:Process") || isA(owner, "bpmn:Collaboration");
}

export function draws(diagram: ModdleElement, element: string): boolean {
  return drawnBy(diagram).has(element);
}

/** The id of the process or collaboration that something is in. */
export function outermostOf(element: ModdleElement | undefined): string {
  let at = element;
  while (at?.$parent && !isA(at.$parent, "bpmn:Definitions")) at = at.$parent;
  if (!at) return "";
  const siblings = list(at.$parent, "rootElements");
  const collaboration = siblings.find((each) =>
    list(each, "participants").some((pool) => child(pool, "processRef") === at),
  );
  return text(collaboration ?? at, "id");
}

/** Of all diagrams, the outermost ones that can be drawn beside one: nothing is drawn twice. */
export function beside(shown: ModdleElement, all: readonly ModdleElement[]): ModdleElement[] {
  const drawn = new Set(withInner(shown, all).flatMap((each) => [...drawnBy(each)]));
  return all.filter((diagram) => {
    if (diagram === shown || !isOutermost(diagram)) return false;
    const ids = withInner(diagram, all).flatMap((each) => [...drawnBy(each)]);
    if (ids.some((id) => drawn.has(id))) return false;
    for (const id of ids) drawn.add(id);
    return true;
  });
}

/** With the diagrams of collapsed subprocesses, of which bpmn-js draws the first of each. */
function withInner(diagram: ModdleElement, all: readonly ModdleElement[]): ModdleElement[] {
  const outermost = outermostOf(ownerOf(diagram));
  const inner = all.filter((each) => {
    const owner = ownerOf(each);
    return owner && !isOutermost(each) && outermostOf(owner) === outermost;
  });
  return [diagram, ...inner];
}

function drawnBy(diagram: ModdleElement): Set<string> {
  const shapes = list(child(diagram, "plane"), "planeElement");
  const elements = [ownerOf(diagram), ...shapes.map((shape) => child(shape, "bpmnElement"))];
  return new Set(elements.filter((each) => each).map((each) => text(each!, "id")));
}
