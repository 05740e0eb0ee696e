// A mission as it is shown: its elements as a tree, and the diagrams in which they are drawn.
import { strings } from "../../strings";
import type { Collaboration, Definitions, Element, FlowNode, Process } from "./moddle";
import { viewsOf, type View } from "./views";

export interface MissionNode {
  process: string;
  id: string;
  /** As BPMN names it: `ScriptTask`; `Process` for a process. */
  type: string;
  label: string;
  children: MissionNode[];
  /** The process that a call activity calls. */
  calls: string;
}

export interface Definition {
  id: string;
  name: string;
  /** Whether the mission says that operators send it. */
  operators: boolean;
}

export interface MissionModel {
  files: readonly { name: string; xml: string }[];
  trees: MissionNode[];
  views: View[];
  signals: Definition[];
  messages: Definition[];
  node(process: string, element: string): MissionNode | undefined;
  /** The view in which an element is drawn. */
  viewOf(process: string, element: string): View | undefined;
  label(process: string, element: string): string;
  definition(id: string): string;
}

export const keyOf = (process: string, element: string): string => `${process}\n${element}`;

const unnamed: Readonly<Record<string, string>> = strings.operate.outline.unnamed;

export function labelOf(element: Element): string {
  const name = element.name?.replace(/\s+/g, " ").trim();
  return name || unnamed[element.$type.replace("bpmn:", "")] || element.id;
}

export interface MissionSource {
  name: string;
  xml: string;
  definitions: Definitions;
}

export function missionModel(sources: readonly MissionSource[], first: string): MissionModel {
  const roots = sources.flatMap(({ definitions }) => definitions.rootElements ?? []);
  const processes = roots.filter((root) => root.$instanceOf("bpmn:Process")) as Process[];
  const names = participantNames(roots);
  const trees = processes
    .map((process) => treeOf(process, names))
    .sort((one, other) => Number(other.id === first) - Number(one.id === first));
  const nodes = new Map<string, MissionNode>();
  for (const tree of trees) index(tree, nodes);
  const views = sources.flatMap((source, file) => viewsOf(source, file, sources.length > 1));
  const viewByElement = new Map<string, View>();
  for (const view of views) {
    for (const key of view.elements) if (!viewByElement.has(key)) viewByElement.set(key, view);
  }
  const definitions = new Map(roots.map((root) => [root.id, root.name || root.id]));
  return {
    files: sources,
    trees,
    views,
    signals: definitionsOf(roots, "bpmn:Signal"),
    messages: definitionsOf(roots, "bpmn:Message"),
    node: (process, element) => nodes.get(keyOf(process, element)),
    viewOf: (process, element) => viewByElement.get(keyOf(process, element)),
    label: (process, element) => nodes.get(keyOf(process, element))?.label ?? element,
    definition: (id) => definitions.get(id) ?? id,
  };
}

function participantNames(roots: readonly Element[]): Map<string, string> {
  const names = new Map<string, string>();
  for (const root of roots) {
    for (const { name, processRef } of (root as Collaboration).participants ?? []) {
      if (name && processRef) names.set(processRef.id, name);
    }
  }
  return names;
}

function treeOf(process: Process, names: Map<string, string>): MissionNode {
  return {
    process: process.id,
    id: process.id,
    type: "Process",
    label: process.name || names.get(process.id) || process.id,
    children: inOrder(process.flowElements ?? []).map((node) => nodeOf(node, process.id)),
    calls: "",
  };
}

function nodeOf(element: FlowNode, process: string): MissionNode {
  return {
    process,
    id: element.id,
    type: element.$type.replace("bpmn:", ""),
    label: labelOf(element),
    children: inOrder(element.flowElements ?? []).map((child) => nodeOf(child, process)),
    calls: (element.calledElement ?? "").replace(/^.*:/, ""),
  };
}

/** As tokens come to them: from the start along the flows, boundary events after their activity. */
function inOrder(elements: readonly Element[]): FlowNode[] {
  const nodes = elements.filter((each) => each.$instanceOf("bpmn:FlowNode")) as FlowNode[];
  const found = new Set<FlowNode>();
  const visit = (start: FlowNode) => {
    const waiting = [start];
    for (let node = waiting.shift(); node; node = waiting.shift()) {
      if (found.has(node)) continue;
      found.add(node);
      const targets = (node.outgoing ?? []).flatMap(({ targetRef }) => targetRef ?? []);
      const attached = nodes.filter(({ attachedToRef }) => attachedToRef === node);
      waiting.unshift(...attached, ...targets);
    }
  };
  const begins = (node: FlowNode) => !node.incoming?.length && !node.attachedToRef;
  for (const node of [...nodes.filter(begins), ...nodes]) visit(node);
  return [...found];
}

function index(node: MissionNode, nodes: Map<string, MissionNode>): void {
  nodes.set(keyOf(node.process, node.id), node);
  for (const child of node.children) index(child, nodes);
}

function definitionsOf(roots: readonly Element[], type: string): Definition[] {
  return roots
    .filter((root) => root.$instanceOf(type))
    .map(({ id, name, $attrs }) => ({
      id,
      name: name || id,
      operators: $attrs["m2pem:from"] === "operator",
    }))
    .sort((one, other) => Number(other.operators) - Number(one.operators));
}
