// The states of an element in words, for screen readers.
import type { ElementState } from "../../shared/types";
import { fill, strings } from "../../strings";
import { lookOf } from "./colours";

const { outline: text, diagram } = strings.operate;

/** Which requirements an element violates; "": none. */
export const violationOf = (names: readonly string[]): string =>
  names.length > 0 ? fill(strings.monitors.element, { names: names.join(", ") }) : "";

export const statesOf = (state: ElementState | undefined): string[] => [
  diagram.states[state ? lookOf(state) : "idle"],
  ...visitsOf(state),
];

/** How often it was entered, and how many tokens are there at once. */
export function visitsOf(state: ElementState | undefined): string[] {
  if (!state) return [];
  const { hits, active } = state;
  return [
    hits === 0 ? "" : hits === 1 ? text.once : fill(text.times, { count: hits }),
    active > 1 ? fill(text.tokens, { count: active }) : "",
  ];
}
