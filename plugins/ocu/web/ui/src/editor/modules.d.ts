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
