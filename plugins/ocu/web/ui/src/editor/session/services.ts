// The services of bpmn-js that the editor uses, by their names.
import type AutoPlace from "bpmn-js/lib/features/auto-place/BpmnAutoPlace";
import type BpmnFactory from "bpmn-js/lib/features/modeling/BpmnFactory";
import type ElementFactory from "bpmn-js/lib/features/modeling/ElementFactory";
import type Modeling from "bpmn-js/lib/features/modeling/Modeling";
import type BpmnReplace from "bpmn-js/lib/features/replace/BpmnReplace";
import type { Element } from "bpmn-js/lib/model/Types";
import type CommandStack from "diagram-js/lib/command/CommandStack";
import type Canvas from "diagram-js/lib/core/Canvas";
import type ElementRegistry from "diagram-js/lib/core/ElementRegistry";
import type EventBus from "diagram-js/lib/core/EventBus";
import type EditorActions from "diagram-js/lib/features/editor-actions/EditorActions";
import type Overlays from "diagram-js/lib/features/overlays/Overlays";
import type PopupMenu from "diagram-js/lib/features/popup-menu/PopupMenu";
import type Selection from "diagram-js/lib/features/selection/Selection";
import type { Fragments } from "../blocks/control/placing";
import type { Catalogue } from "./catalogue";
import type { Edits } from "./edits";
import type { FindingMarks } from "./findingMarks";
import type { Processes } from "./processes";

export type { Element };
export type { AutoPlace, BpmnFactory, BpmnReplace, Canvas, CommandStack, ElementFactory };
export type { ElementRegistry, EventBus, Modeling, Overlays, PopupMenu, Selection };

export interface Create {
  start(
    event: Event,
    shape: Element,
    context?: { source?: Element; hints?: { autoSelect: boolean } },
  ): void;
}

export interface SpaceTool {
  calculateAdjustments(
    elements: readonly object[],
    axis: "x" | "y",
    delta: number,
    start: number,
  ): { movingShapes: object[]; resizingShapes: object[] };
  makeSpace(
    movingShapes: object[],
    resizingShapes: object[],
    delta: { x: number; y: number },
    direction: "e" | "s",
    start: number,
  ): void;
}

export interface Rules {
  allowed(action: string, context: object): boolean | null;
}

export interface Minimap {
  toggle(open?: boolean): void;
  isOpen(): boolean;
}

export interface PropertiesPanel {
  attachTo(parent: HTMLElement): void;
  detach(): void;
  registerProvider(priority: number, provider: object): void;
}

export interface Services {
  autoPlace: AutoPlace & { append(source: Element, shape: Element): Element };
  bpmnFactory: BpmnFactory;
  bpmnReplace: BpmnReplace;
  canvas: Canvas;
  catalogue: Catalogue;
  commandStack: CommandStack;
  create: Create;
  editorActions: EditorActions;
  edits: Edits;
  elementFactory: ElementFactory;
  elementRegistry: ElementRegistry;
  eventBus: EventBus;
  findingMarks: FindingMarks;
  fragments: Fragments;
  minimap: Minimap;
  modeling: Modeling;
  overlays: Overlays;
  popupMenu: PopupMenu;
  processes: Processes;
  propertiesPanel: PropertiesPanel;
  rules: Rules;
  selection: Selection;
}
