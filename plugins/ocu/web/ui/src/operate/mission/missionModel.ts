// A mission as it is shown: its elements as a tree, and the diagrams in which they are drawn.
import { kindOf, labelOf } from "../../shared/elementNames";
import type { Collaboration, Definitions, Element, FlowNode, Process } from "./moddle";
import { drawnAs, keyOf, qualified } from "./names";
import { viewsOf, type View } from "./views";

export interface MissionNode {
  process: string;
  id: string;
  /** As BPMN names it: `ScriptTask`; `Process` for a process. */
  type: string;
  /** In words: "timer boundary event". */
  kind: string;
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
  files: readonly { name: string; qualifier: string; xml: string }[];
  trees: MissionNode[];
  views: View[];
  signals: Definition[];
  messages: Definition[];
  node(process: string, element: string): MissionNode | undefined;
  /** All elements and processes of an id: records about requirements name no process. */
  nodesOf(id: string): readonly MissionNode[];
  /** The view in which an element is drawn. */
  viewOf(process: string, element: string): View | undefined;
  label(process: string, element: string): string;
  definition(id: string): string;
}

export interface MissionSource {
  name: string;
  /** Before the ids of its elements in records; "": the mission's own file. */
  qualifier: string;
  xml: string;
  definitions: Definitions;
}

export function missionModel(sources: readonly MissionSource[], first: string): MissionModel {
  const trees = sources
    .flatMap(treesOf)
    .sort((one, other) => Number(other.id === first) - Number(one.id === first));
  const nodes = new Map<string, MissionNode>();
  for (const tree of trees) index(tree, nodes);
  const byId = new Map<string, MissionNode[]>();
  for (const node of nodes.values()) {
    const id = drawnAs(node.id);
    byId.set(id, [...(byId.get(id) ?? []), node]);
  }
  const views = sources.flatMap((source, file) => viewsOf(source, file, sources.length > 1));
  const viewByElement = new Map<string, View>();
  for (const view of views) {
    for (const key of view.elements) if (!viewByElement.has(key)) viewByElement.set(key, view);
  }
  const roots = sources.flatMap(({ definitions }) => definitions.rootElements ?? []);
  const definitions = definedIn(sources);
  return {
    files: sources,
    trees,
    views,
    signals: definitionsOf(roots, "bpmn:Signal"),
    messages: definitionsOf(roots, "bpmn:Message"),
    node: (process, element) => nodes.get(keyOf(process, element)),
    nodesOf: (id) => byId.get(drawnAs(id)) ?? [],
    viewOf: (process, element) => viewByElement.get(keyOf(process, element)),
    label: (process, element) => nodes.get(keyOf(process, element))?.label ?? element,
    definition: (id) => definitions.get(id) ?? definitions.get(drawnAs(id)) ?? id,
  };
}

function definedIn(sources: readonly MissionSource[]): Map<string, string> {
  const names = new Map<string, string>();
  for (const { qualifier, definitions } of sources) {
    for (const { id, name } of definitions.rootElements ?? []) {
      if (!id) continue;
      names.set(id, name || id);
      names.set(qualified(qualifier, id), name || id);
    }
  }
  return names;
}

function treesOf({ qualifier, definitions }: MissionSource): MissionNode[] {
  const roots = definitions.rootElements ?? [];
  const pools = participantNames(roots);
  return (roots.filter((root) => root.$instanceOf("bpmn:Process")) as Process[]).map((process) => {
    const id = qualified(qualifier, process.id);
    return {
      process: id,
      id,
      type: "Process",
      kind: kindOf(process),
      label: process.name || pools.get(process.id) || process.id,
      children: childrenOf(process.flowElements, id, qualifier),
      calls: "",
    };
  });
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

function childrenOf(
  elements: readonly Element[] | undefined,
  process: string,
  qualifier: string,
): MissionNode[] {
  return inOrder(elements ?? []).map((element) => ({
    process,
    id: qualified(qualifier, element.id),
    type: element.$type.replace("bpmn:", ""),
    kind: kindOf(element),
    label: labelOf(element),
    children: childrenOf(element.flowElements, process, qualifier),
    calls: (element.calledElement ?? "").replace(/^.*:/, ""),
  }));
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
