// What passes into a called process, and out of it.
import { extensions, replaced, type Change } from "./extensions";
import { text, type Factory, type ModdleElement } from "./moddle";

export interface Mapping {
  source: string;
  target: string;
}

export type Direction = "in" | "out";

const TYPES: Record<Direction, string> = { in: "m2pem:In", out: "m2pem:Out" };

export function mappingsOf(call: ModdleElement, direction: Direction): Mapping[] {
  return extensions(call, TYPES[direction]).map((each) => ({
    source: text(each, "source"),
    target: text(each, "target"),
  }));
}

export function setMappings(
  factory: Factory,
  call: ModdleElement,
  direction: Direction,
  mappings: readonly Mapping[],
): Change[] {
  const type = TYPES[direction];
  const made = mappings.map((mapping) => factory.create(type, { ...mapping }));
  return [replaced(factory, call, [type], made)];
}
