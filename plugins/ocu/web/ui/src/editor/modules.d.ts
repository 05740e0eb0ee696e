// Types of packages that have none.
declare module "bpmn-moddle" {
  type Element = import("./moddle/moddle").ModdleElement;
  export class BpmnModdle {
    constructor(packages?: Record<string, object>);
    create(type: string, attributes?: Record<string, unknown>): Element;
    fromXML(xml: string): Promise<{ rootElement: Element; warnings: Error[] }>;
    toXML(element: Element, options?: { format?: boolean }): Promise<{ xml: string }>;
  }
}

declare module "bpmn-js-differ" {
  type Element = import("./moddle/moddle").ModdleElement;
  export function diff(before: Element, after: Element): { _layoutChanged: Record<string, Element> };
}

declare module "@bpmn-io/properties-panel" {
  export const Group: import("preact").ComponentType<Record<string, unknown>>;
}

declare module "bpmn-js-properties-panel" {
  export const BpmnPropertiesPanelModule: object;
  export const BpmnPropertiesProviderModule: object;
}

declare module "bpmn-js-create-append-anything" {
  export const CreateAppendAnythingModule: object;
}

declare module "diagram-js-minimap" {
  const MinimapModule: object;
  export default MinimapModule;
}
