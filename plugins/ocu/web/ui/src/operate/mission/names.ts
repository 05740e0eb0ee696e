// How records name elements: those of a called file by its qualifier as well ("survey:Start").
import { processOf, type Element } from "./moddle";

export const qualified = (qualifier: string, id: string): string =>
  qualifier && id ? `${qualifier}:${id}` : id;

/**
 * An editor's file has another id where bpmn-moddle refuses the mission's own, such as a UUID that
 * begins with a digit.
 */
export function drawnAs(id: string): string {
  const known = drawn.get(id);
  if (known !== undefined) return known;
  const at = id.lastIndexOf(":") + 1;
  const local = id.slice(at);
  const legal = /^[a-z_][\w.-]*$/i.test(local);
  const made = legal ? id : `${id.slice(0, at)}_${local.replace(/[^\w.-]/g, "_")}`;
  drawn.set(id, made);
  return made;
}

const drawn = new Map<string, string>();

/** One text for an element and the process that contains it, as records name them. */
export const keyOf = (process: string, element: string): string =>
  `${drawnAs(process)}\n${drawnAs(element)}`;

export const keyIn = (qualifier: string, element: Element): string =>
  keyOf(qualified(qualifier, processOf(element)), qualified(qualifier, element.id));
