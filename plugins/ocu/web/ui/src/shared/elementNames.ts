// What elements of a diagram are called in words, for screen readers: their names, kinds and states.
import { fill, strings } from "../strings";

/** An element of the BPMN file, as bpmn-moddle gives it. */
export interface NamedElement {
  $type: string;
  id: string;
  name?: string;
  /** Of a text annotation. */
  text?: string;
  eventDefinitions?: { $type: string }[];
}

/** What bpmn-js draws of it; a connection has both ends. */
export interface DrawnElement {
  businessObject?: unknown;
  source?: DrawnElement;
  target?: DrawnElement;
}

const unnamed: Readonly<Record<string, string>> = strings.operate.outline.unnamed;

export function labelOf(element: NamedElement): string {
  return nameOf(element) || unnamed[local(element.$type)] || element.id;
}

/** As BPMN calls it: "script task", "timer boundary event". */
export function kindOf({ $type, eventDefinitions = [] }: NamedElement): string {
  const [first, ...more] = eventDefinitions;
  const event = first && local(first.$type).replace("EventDefinition", "");
  return inWords(`${more.length > 0 ? "Multiple" : (event ?? "")}${local($type)}`);
}

/** `ScriptTask` as words. */
export const inWords = (type: string): string =>
  type.replace(/(?<=[a-z])(?=[A-Z])/g, " ").toLowerCase();

/** Name and kind, and of a connection where it leads from and to; then the states. */
export function described(drawn: DrawnElement, states: readonly string[] = []): string {
  const element = drawn.businessObject as NamedElement;
  const [source, target] = [drawn.source, drawn.target].map(
    (end) => end && labelOf(end.businessObject as NamedElement),
  );
  const kind = kindOf(element);
  const isBetween = source !== undefined && target !== undefined;
  const said = isBetween ? fill(strings.operate.diagram.between, { kind, source, target }) : kind;
  return [isBetween ? nameOf(element) : labelOf(element), said, ...states]
    .filter(Boolean)
    .join(", ");
}

/** Says on the symbol of an element what a screen reader calls it. */
export function nameSymbol(symbol: Element, name: string): void {
  if (symbol.getAttribute("aria-label") === name) return;
  symbol.setAttribute("role", "img");
  symbol.setAttribute("aria-label", name);
}

const local = (type: string): string => type.replace(/^.*:/, "");

const nameOf = ({ name, text }: NamedElement): string =>
  (name ?? text ?? "").replace(/\s+/g, " ").trim();
