// How records name elements: those of a called file by its qualifier as well ("survey:Start").
import { processOf, type Element } from "./moddle";

export const qualified = (qualifier: string, id: string): string =>
  qualifier && id ? `${qualifier}:${id}` : id;

/** One text for an element and the process that contains it, as records name them. */
export const keyOf = (process: string, element: string): string => `${process}\n${element}`;

export const keyIn = (qualifier: string, element: Element): string =>
  keyOf(qualified(qualifier, processOf(element)), qualified(qualifier, element.id));
