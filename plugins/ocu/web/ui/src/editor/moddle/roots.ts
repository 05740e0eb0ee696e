// Signals, messages, errors and escalations: root elements of the file, which events share by id.
// People see names; the id is a UUID that is made once (docs/missions.md).
import type { Change } from "./extensions";
import { adopt, isA, list, text, type Factory, type ModdleElement } from "./moddle";

export type RootKind = "signal" | "message" | "error" | "escalation";

interface RootType {
  type: string;
  /** Of an event definition or task that refers to it. */
  reference: string;
  /** The attribute by which errors and escalations are matched. */
  code?: string;
}

export const ROOT_TYPES: Record<RootKind, RootType> = {
  signal: { type: "bpmn:Signal", reference: "signalRef" },
  message: { type: "bpmn:Message", reference: "messageRef" },
  error: { type: "bpmn:Error", reference: "errorRef", code: "errorCode" },
  escalation: { type: "bpmn:Escalation", reference: "escalationRef", code: "escalationCode" },
};

export interface Reference {
  kind: RootKind;
  /** What refers: an event definition, or a send or receive task. */
  holder: ModdleElement;
  root: ModdleElement | undefined;
}

export function referencesOf(element: ModdleElement): Reference[] {
  const holders = [...list(element, "eventDefinitions")];
  if (isA(element, "bpmn:SendTask") || isA(element, "bpmn:ReceiveTask")) holders.push(element);
  return holders.flatMap((holder) => {
    const kind = kindOf(holder);
    if (!kind) return [];
    const root = holder.get(ROOT_TYPES[kind].reference) as ModdleElement | undefined;
    return [{ kind, holder, root }];
  });
}

function kindOf(holder: ModdleElement): RootKind | undefined {
  if (isA(holder, "bpmn:SignalEventDefinition")) return "signal";
  if (isA(holder, "bpmn:ErrorEventDefinition")) return "error";
  if (isA(holder, "bpmn:EscalationEventDefinition")) return "escalation";
  const isMessage = ["bpmn:MessageEventDefinition", "bpmn:SendTask", "bpmn:ReceiveTask"];
  return isMessage.some((type) => isA(holder, type)) ? "message" : undefined;
}

export function rootsOf(definitions: ModdleElement, kind: RootKind): ModdleElement[] {
  return list(definitions, "rootElements").filter((each) => isA(each, ROOT_TYPES[kind].type));
}

/** The file's root element that bears a name, or a code; errors are mostly known by their codes. */
export function rootNamed(
  definitions: ModdleElement,
  kind: RootKind,
  name: string,
): ModdleElement | undefined {
  const { code } = ROOT_TYPES[kind];
  const roots = rootsOf(definitions, kind);
  return (
    roots.find((each) => text(each, "name") === name) ??
    (code ? roots.find((each) => text(each, code) === name) : undefined)
  );
}

export interface MadeRoot {
  root: ModdleElement;
  change: Change;
}

/** A new root element with a UUID; an error or escalation has its name as its code. */
export function makeRoot(
  factory: Factory,
  definitions: ModdleElement,
  kind: RootKind,
  name: string,
): MadeRoot {
  const { type, code } = ROOT_TYPES[kind];
  const coded = code ? { [code]: codeOf(name) } : {};
  const root = factory.create(type, { id: uuid(), name, ...coded });
  adopt(definitions, root);
  const rootElements = [...list(definitions, "rootElements")];
  const firstProcess = rootElements.findIndex(
    (each) => isA(each, "bpmn:Process") || isA(each, "bpmn:Collaboration"),
  );
  rootElements.splice(firstProcess < 0 ? rootElements.length : firstProcess, 0, root);
  return { root, change: { target: definitions, properties: { rootElements } } };
}

/** "Route blocked" as a code: ROUTE_BLOCKED. What is a code already stays. */
export function codeOf(name: string): string {
  const words = name.trim().replace(/[^\p{L}\p{N}]+/gu, "_");
  return words.replace(/^_+|_+$/g, "").toUpperCase();
}

/** A UUID that may be an id in XML, which cannot begin with a digit. */
export function uuid(): string {
  const made = crypto.randomUUID();
  const first = Number.parseInt(made[0] ?? "0", 16);
  return `${"abcdef"[first % 6]}${made.slice(1)}`;
}
