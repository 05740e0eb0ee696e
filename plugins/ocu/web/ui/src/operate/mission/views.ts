// The pictures of a file that can be shown one at a time: its diagrams, and what is inside its
// collapsed subprocesses.
import {
  processOf,
  type Collaboration,
  type Definitions,
  type Diagram,
  type Element,
  type Process,
} from "./moddle";
import { keyIn } from "./names";

export interface View {
  key: string;
  file: number;
  /** The BPMNDiagram to open. */
  diagram: string;
  /** The id of the root that bpmn-js gives it. */
  root: string;
  title: string;
  /** "": not inside of another view. */
  inside: string;
  /** Keys (names.ts) of what is drawn in it. */
  elements: Set<string>;
}

interface Drawn {
  name: string;
  qualifier: string;
  definitions: Definitions;
}

export function viewsOf(
  { name, qualifier, definitions }: Drawn,
  file: number,
  several: boolean,
): View[] {
  const collapsed = collapsedIn(definitions);
  const views = new Map<string, View>();
  for (const diagram of definitions.diagrams ?? []) {
    const about = diagram.plane?.bpmnElement;
    if (!about || about.$instanceOf("bpmn:SubProcess")) continue;
    const suffix = several ? ` · ${name.replace(/\.bpmn$/, "")}` : "";
    const view = emptyView(
      `${file}/${about.id}`,
      file,
      diagram.id,
      about.id,
      titleOf(about, diagram) + suffix,
    );
    views.set(view.root, view);
  }
  for (const diagram of definitions.diagrams ?? []) {
    for (const { bpmnElement } of diagram.plane?.planeElement ?? []) {
      if (!bpmnElement?.$instanceOf("bpmn:FlowNode")) continue;
      const view = viewFor(bpmnElement, diagram, collapsed, views, file);
      view?.elements.add(keyIn(qualifier, bpmnElement));
    }
  }
  return [...views.values()].filter(({ elements }) => elements.size > 0);
}

function emptyView(key: string, file: number, diagram: string, root: string, title: string): View {
  return { key, file, diagram, root, title, inside: "", elements: new Set() };
}

function collapsedIn(definitions: Definitions): Set<Element> {
  const collapsed = new Set<Element>();
  for (const { plane } of definitions.diagrams ?? []) {
    for (const { bpmnElement, isExpanded } of plane?.planeElement ?? []) {
      if (bpmnElement?.$instanceOf("bpmn:SubProcess") && !isExpanded) collapsed.add(bpmnElement);
    }
  }
  return collapsed;
}

function viewFor(
  element: Element,
  diagram: Diagram,
  collapsed: Set<Element>,
  views: Map<string, View>,
  file: number,
): View | undefined {
  for (let around = element.$parent; around; around = around.$parent) {
    if (collapsed.has(around)) return insideOf(around, diagram, collapsed, views, file);
  }
  const about = diagram.plane?.bpmnElement;
  return about && views.get(about.id);
}

function insideOf(
  subprocess: Element,
  diagram: Diagram,
  collapsed: Set<Element>,
  views: Map<string, View>,
  file: number,
): View | undefined {
  const root = `${subprocess.id}_plane`;
  const known = views.get(root);
  if (known) return known;
  const around = viewAround(subprocess, diagram, collapsed, views, file);
  if (!around) return undefined;
  const title = subprocess.name || subprocess.id;
  const view = emptyView(`${file}/${root}`, file, around.diagram, root, title);
  view.inside = around.key;
  views.set(root, view);
  return view;
}

/** Where the collapsed subprocess itself is drawn; its inside may be in a diagram of its own. */
function viewAround(
  subprocess: Element,
  diagram: Diagram,
  collapsed: Set<Element>,
  views: Map<string, View>,
  file: number,
): View | undefined {
  const around = viewFor(subprocess, diagram, collapsed, views, file);
  if (around) return around;
  const process = processOf(subprocess);
  return [...views.values()].find(({ root }) => root === process);
}

function titleOf(about: Element, diagram: Diagram): string {
  const pools = (about as Collaboration).participants;
  if (!pools) return about.name || diagram.name || (about as Process).id;
  const names = pools.map(({ name, processRef }) => name || processRef?.id || "").filter(Boolean);
  return names.length > 0 && names.length <= 3 ? names.join(" + ") : about.name || about.id;
}
