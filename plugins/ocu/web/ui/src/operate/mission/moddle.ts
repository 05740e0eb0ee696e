// What is looked at in a BPMN file, as bpmn-moddle gives it.

export interface Element {
  $type: string;
  $parent?: Element;
  $attrs: Record<string, string | undefined>;
  $instanceOf(type: string): boolean;
  id: string;
  name?: string;
}

export interface FlowNode extends Element {
  incoming?: SequenceFlow[];
  outgoing?: SequenceFlow[];
  flowElements?: Element[];
  attachedToRef?: FlowNode;
  calledElement?: string;
}

export interface SequenceFlow extends Element {
  targetRef?: FlowNode;
}

export interface Process extends Element {
  flowElements?: Element[];
}

export interface Collaboration extends Element {
  participants?: (Element & { processRef?: Process })[];
}

export interface Shape {
  $type: string;
  isExpanded?: boolean;
  bpmnElement?: Element;
}

export interface Diagram {
  id: string;
  name?: string;
  plane?: { bpmnElement?: Element; planeElement?: Shape[] };
}

export interface Definitions extends Element {
  rootElements?: Element[];
  diagrams?: Diagram[];
}

/** The process that contains an element; "": none does. */
export function processOf(element: Element): string {
  for (let around: Element | undefined = element; around; around = around.$parent) {
    if (around.$instanceOf("bpmn:Process")) return around.id;
  }
  return "";
}
