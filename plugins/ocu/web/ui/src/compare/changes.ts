// What is other in a later version of a mission: elements that were added, removed, changed or moved.
import { diff } from "bpmn-js-differ";
import { isA, list, text, type ModdleElement } from "../editor/moddle/moddle";
import { fill, strings } from "../strings";
import { propertiesOf } from "./properties";

const words = strings.compare;

export type ChangeKind = "added" | "removed" | "changed" | "moved";

export interface ElementChange {
  kind: ChangeKind;
  id: string;
  /** Its name, or its type and id. */
  label: string;
  /** In words: `speed: 3 m/s → 5 m/s`. */
  details: string[];
}

export function changesOf(before: ModdleElement, after: ModdleElement): ElementChange[] {
  const old = elementsOf(before);
  const now = elementsOf(after);
  const moved = new Set(Object.keys(diff(before, after)._layoutChanged));
  const found: ElementChange[] = [];
  for (const [id, element] of now) {
    const earlier = old.get(id);
    if (!earlier) {
      found.push({ kind: "added", id, label: labelOf(element), details: [] });
      continue;
    }
    const details = detailsOf(earlier, element);
    if (details.length > 0) found.push({ kind: "changed", id, label: labelOf(element), details });
    // A flow follows what it connects.
    else if (moved.has(id) && !isA(element, "bpmn:SequenceFlow")) {
      found.push({ kind: "moved", id, label: labelOf(element), details: [] });
    }
  }
  for (const [id, element] of old) {
    if (!now.has(id)) found.push({ kind: "removed", id, label: labelOf(element), details: [] });
  }
  return found;
}

/** All elements with an id that a version may add, remove or change, in the order of the file. */
export function elementsOf(definitions: ModdleElement): Map<string, ModdleElement> {
  const found = new Map<string, ModdleElement>();
  const add = (element: ModdleElement) => {
    const id = text(element, "id");
    if (id) found.set(id, element);
    for (const inside of ["participants", "messageFlows", "flowElements", "artifacts"]) {
      if (hasProperty(element, inside)) list(element, inside).forEach(add);
    }
  };
  list(definitions, "rootElements").forEach(add);
  return found;
}

const hasProperty = (element: ModdleElement, name: string): boolean =>
  name in
  ((element.$descriptor as unknown as { propertiesByName?: object }).propertiesByName ?? {});

function labelOf(element: ModdleElement): string {
  const name = hasProperty(element, "name") ? text(element, "name").replace(/\s+/g, " ") : "";
  if (name) return name;
  const type = element.$type.split(":").at(-1)!;
  return `${type.replace(/([a-z])([A-Z])/g, "$1 $2").toLowerCase()} ${text(element, "id")}`;
}

function detailsOf(before: ModdleElement, after: ModdleElement): string[] {
  const old = propertiesOf(before);
  const now = propertiesOf(after);
  if (before.$type !== after.$type) {
    for (const [found, { $type }] of [[old, before], [now, after]] as const) {
      const type = $type.split(":").at(-1)!;
      found.set("type", { text: type, compared: type });
    }
  }
  return [...new Set([...old.keys(), ...now.keys()])].flatMap((label) => {
    const [one, other] = [old.get(label), now.get(label)];
    if (one?.compared === other?.compared) return [];
    const values = { label, before: one?.text ?? words.empty, after: other?.text ?? words.empty };
    if (one === undefined) return [fill(words.rowAdded, values)];
    return [fill(other === undefined ? words.rowRemoved : words.row, values)];
  });
}
