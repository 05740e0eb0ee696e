// What a BPMN element says, as names and texts: to say in words what is other in another version.
import { isA, type ModdleElement } from "../editor/moddle/moddle";
import { strings } from "../strings";

const { labels, types } = strings.compare;

interface Property {
  name: string;
  ns: { localName: string };
  isMany?: boolean;
  isReference?: boolean;
  isVirtual?: boolean;
  isBody?: boolean;
  isId?: boolean;
}

/** Elements of their own, or what the diagram itself shows. */
const STRUCTURE = new Set([
  ...["id", "incoming", "outgoing", "flowElements", "artifacts", "laneSets", "participants"],
  ...["messageFlows", "flowNodeRef", "boundaryEventRefs", "exporter", "exporterVersion"],
]);

/** What only holds other things. */
const WRAPPERS = new Set(["extensionElements", "values", "parameters", "allocation", "head"]);

const propertiesOfType = (element: ModdleElement): Property[] =>
  (element.$descriptor as unknown as { properties: Property[] }).properties ?? [];

export interface PropertyValue {
  text: string;
  /** Of a reference the id of its target, which stays when that gets another name. */
  compared: string;
}

export type Properties = Map<string, PropertyValue>;

/** Names of properties, with all of what is inside the element, and their values. */
export function propertiesOf(element: ModdleElement): Properties {
  const found: Properties = new Map();
  collect(element, [], found);
  return found;
}

function collect(element: ModdleElement, path: readonly string[], found: Properties) {
  for (const property of propertiesOfType(element)) {
    const local = property.ns.localName;
    if (property.isVirtual || property.isId || STRUCTURE.has(local)) continue;
    const value = element.get(property.name);
    const values = property.isMany ? ((value as unknown[] | undefined) ?? []) : [value];
    if (property.isReference) {
      for (const each of values) put(found, [...path, labelOf(local)], nameOf(each), idOf(each));
    } else if (property.isBody) {
      put(found, path, String(value ?? "").trim());
    } else {
      for (const each of values) add(each, local, path, found);
    }
  }
  for (const [name, value] of Object.entries(element.$attrs)) {
    if (!name.startsWith("xmlns")) put(found, [...path, name], String(value));
  }
}

function add(value: unknown, local: string, path: readonly string[], found: Properties) {
  if (value === undefined || value === null) return;
  if (!isModdle(value)) {
    // The name of a behavior is what it does; that of an element is its name.
    const isWhat = path.length > 0 && (local === "name" || local === "class");
    put(found, isWhat ? path : [...path, labelOf(local)], String(value));
    return;
  }
  const own = value.$descriptor.isGeneric ? "" : String(value.get("name") ?? "");
  if (isA(value, "m2pem:Property") || isA(value, "m2pem:Arg")) {
    put(found, [...path, own], String(value.get("value") ?? value.get("body") ?? "").trim());
  } else if (isA(value, "m2pem:Geometry")) {
    return; // the map shows it
  } else if (isA(value, "bpmn:Expression")) {
    put(found, [...path, labelOf(local)], String(value.get("body") ?? "").trim());
  } else if (isA(value, "bpmn:Documentation")) {
    put(found, [...path, labelOf(local)], String(value.get("text") ?? "").trim());
  } else if (value.$descriptor.isGeneric) {
    put(found, [...path, value.$type], generic(value));
  } else if (WRAPPERS.has(local) && !value.$type.startsWith("m2pem:")) {
    collect(value, path, found);
  } else if (local === "parameters" || local === "allocation" || local === "eventDefinitions") {
    collect(value, path, found);
  } else {
    const type = value.$type.split(":").at(-1)!;
    const kind = types[type] ?? words(type);
    const isNamed = own !== "" && type !== "Behavior" && type !== "Service";
    const isBpmn = value.$type.startsWith("bpmn:");
    collect(value, isBpmn ? path : [...path, isNamed ? `${kind} ${own}` : kind], found);
  }
}

const isModdle = (value: unknown): value is ModdleElement =>
  typeof value === "object" && value !== null && "$type" in value;

/** Values of one name are together, in the order of the file. */
function put(found: Properties, path: readonly string[], text: string, compared = text) {
  if (text === "") return;
  const name = path.join(", ");
  const known = found.get(name);
  found.set(
    name,
    known === undefined
      ? { text, compared }
      : { text: `${known.text}, ${text}`, compared: `${known.compared}, ${compared}` },
  );
}

const idOf = (value: unknown): string =>
  (isModdle(value) && String(value.get("id") ?? "")) || nameOf(value);

function nameOf(value: unknown): string {
  if (!isModdle(value)) return value === undefined ? "" : String(value);
  return String(value.get("name") ?? "") || String(value.get("id") ?? "");
}

function generic(element: ModdleElement): string {
  const { $children, $body } = element as unknown as {
    $children?: ModdleElement[];
    $body?: string;
  };
  const attributes = Object.entries(element).filter(
    ([key, value]) => !key.startsWith("$") && typeof value === "string",
  );
  return [
    ...attributes.map(([key, value]) => `${key}=${value}`),
    $body?.trim() ?? "",
    ...($children ?? []).map((each) => `${each.$type}(${generic(each)})`),
  ]
    .filter(Boolean)
    .join(" ");
}

const labelOf = (local: string): string => labels[local] ?? words(local);

/** `onLoss` is "on loss". */
const words = (name: string): string =>
  name.replace(/([a-z])([A-Z])/g, (_, end: string, next: string) => `${end} ${next.toLowerCase()}`);
