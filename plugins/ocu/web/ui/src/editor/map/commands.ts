// Where a mission commands something: its tasks in the order of the flow, with the places that they
// name.
import type { Geometry } from "../../shared/types";
import { behaviorOf, serviceOf } from "../moddle/behavior";
import { child, isA, list, text, type ModdleElement } from "../moddle/moddle";
import { processesIn } from "../moddle/geometries";
import type { Vertex } from "../../map/draft";

export interface MapCommand {
  task: string;
  title: string;
  /** From 1, in the order of the flow, among those that have a place. */
  number: number;
  /** The geometry that a parameter names; "": it has coordinates. */
  geometry: string;
  at: Vertex | null;
  /** The resource that does it; "": it is chosen later. */
  who: string;
}

/** The elements that commands stand in, as the flow reaches them: calls are followed. */
export function inFlowOrder(definitions: ModdleElement | undefined): ModdleElement[] {
  const order: ModdleElement[] = [];
  const seen = new Set<ModdleElement>();
  const processes = processesIn(definitions);
  const called = (id: string) => processes.find((each) => text(each, "id") === id);

  const container = (each: ModdleElement) => {
    if (seen.has(each)) return;
    seen.add(each);
    const nodes = list(each, "flowElements").filter((node) => isA(node, "bpmn:FlowNode"));
    const first = nodes.filter((node) => list(node, "incoming").length === 0 && !hostOf(node));
    for (const node of forwards(first, nodes)) {
      order.push(node);
      if (isA(node, "bpmn:SubProcess")) container(node);
      const target = isA(node, "bpmn:CallActivity") && called(text(node, "calledElement"));
      if (target) container(target);
    }
  };
  const begins = (each: ModdleElement) => each.get("isExecutable") === true;
  for (const each of processes.filter(begins)) container(each);
  for (const each of processes) container(each);
  return order;
}

/** Each before those that come after it, except around loops (reverse postorder); then those that
 * nothing leads to. */
function forwards(
  first: readonly ModdleElement[],
  all: readonly ModdleElement[],
): readonly ModdleElement[] {
  const seen = new Set<ModdleElement>();
  return [...reversePostorder(first, seen), ...reversePostorder(all, seen)];
}

function reversePostorder(
  roots: readonly ModdleElement[],
  seen: Set<ModdleElement>,
): ModdleElement[] {
  const done: ModdleElement[] = [];
  const visit = (root: ModdleElement) => {
    // No recursion: a mission may be longer than the browser's stack.
    const stack: { node: ModdleElement; next: ModdleElement[] }[] = [];
    const enter = (node: ModdleElement) => {
      if (seen.has(node)) return;
      seen.add(node);
      stack.push({ node, next: followers(node) });
    };
    enter(root);
    while (stack.length > 0) {
      const top = stack.at(-1)!;
      const next = top.next.pop();
      if (next) enter(next);
      else done.push(stack.pop()!.node);
    }
  };
  for (const root of [...roots].reverse()) visit(root);
  return done.reverse();
}

const hostOf = (node: ModdleElement) => child(node, "attachedToRef");

/** What is done when something happens comes after what is done otherwise. */
function followers(node: ModdleElement): ModdleElement[] {
  const next = list(node, "outgoing").flatMap((flow) => child(flow, "targetRef") ?? []);
  const siblings = node.$parent ? list(node.$parent, "flowElements") : [];
  return [...next, ...siblings.filter((each) => hostOf(each) === node)];
}

type Place = Pick<MapCommand, "geometry" | "at">;

const PLACE = /^\s*\[\s*(-?[\d.]+)\s*,\s*(-?[\d.]+)\s*(?:,[^\]]*)?\]\s*$/;

export function commandsOf(
  definitions: ModdleElement | undefined,
  geometries: readonly Geometry[],
): MapCommand[] {
  const names = new Set(geometries.map(({ name }) => name));
  const found: MapCommand[] = [];
  let number = 0;
  for (const task of inFlowOrder(definitions)) {
    const use = behaviorOf(task) ?? (isA(task, "bpmn:ServiceTask") ? serviceOf(task) : undefined);
    const places = (use?.parameters ?? []).flatMap(({ value }): Place[] => {
      if (names.has(value)) return [{ geometry: value, at: null }];
      const at = placeIn(value);
      return at ? [{ geometry: "", at }] : [];
    });
    if (!use || places.length === 0) continue;
    number += 1;
    const who = use.roles.find(({ resource }) => resource !== "")?.resource ?? "";
    const title = text(task, "name") || use.name;
    for (const place of places) found.push({ task: text(task, "id"), title, number, who, ...place });
  }
  return found;
}

export function placeIn(value: string): Vertex | null {
  const match = PLACE.exec(value);
  const [latitude, longitude] = [Number(match?.[1]), Number(match?.[2])];
  if (!match || !(Math.abs(latitude) <= 90) || !(Math.abs(longitude) <= 180)) return null;
  return { latitude, longitude, altitude: null };
}
