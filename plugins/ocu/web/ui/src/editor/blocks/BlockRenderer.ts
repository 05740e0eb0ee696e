// Draws tasks that command something: what kind of thing, and who does it.
import type BpmnRenderer from "bpmn-js/lib/draw/BpmnRenderer";
import BaseRenderer from "diagram-js/lib/draw/BaseRenderer";
import { strings } from "../../strings";
import { behaviorOf, serviceOf, type BehaviorUse, type Role } from "../moddle/behavior";
import { isA, type ModdleElement } from "../moddle/moddle";
import type { Catalogue } from "../session/catalogue";
import type { Element, EventBus } from "../session/services";
import type { BlockGroup } from "./blocks";
import { COLORS, ICONS } from "./icons";

const BEFORE_BPMN = 1500;
const SVG = "http://www.w3.org/2000/svg";
const STRIP_HEIGHT = 16;
const CORNER = 10;
const SHOWN_CHARACTERS = 16;

interface Drawn {
  group: BlockGroup;
  /** Who does it; undefined: nobody needs to. */
  who: string | undefined;
  missing: boolean;
}

type Handler = (gfx: SVGElement, element: Element, attrs?: object) => SVGElement;

export class BlockRenderer extends BaseRenderer {
  static readonly $inject = ["eventBus", "bpmnRenderer", "catalogue"];

  constructor(
    eventBus: EventBus,
    private readonly bpmnRenderer: BpmnRenderer & { handlers: Record<string, Handler> },
    private readonly catalogue: Catalogue,
  ) {
    super(eventBus as never, BEFORE_BPMN);
  }

  override canRender(element: Element): boolean {
    return isCommanding(element) && drawnOf(this.catalogue, element.businessObject) !== undefined;
  }

  override drawShape(gfx: SVGElement, element: Element & { width: number; height: number }) {
    const drawn = drawnOf(this.catalogue, element.businessObject)!;
    const task = this.bpmnRenderer.handlers["bpmn:Task"]!(gfx, element);
    gfx.append(icon(drawn.group));
    if (drawn.who !== undefined) gfx.append(strip(element, drawn));
    return task;
  }

  override getShapePath(element: Element) {
    return this.bpmnRenderer.getShapePath(element as never);
  }
}

function isCommanding(element: Element & { labelTarget?: unknown }): boolean {
  if (element.labelTarget) return false;
  const types = ["bpmn:ScriptTask", "bpmn:ServiceTask", "bpmn:SendTask", "bpmn:BusinessRuleTask"];
  return types.some((type) => isA(element.businessObject, type));
}

function drawnOf(catalogue: Catalogue, task: ModdleElement): Drawn | undefined {
  const behavior = behaviorOf(task);
  if (behavior) return { group: groupOf(catalogue, behavior), ...whoOf(behavior.roles, true) };
  if (isA(task, "bpmn:ScriptTask")) return undefined;
  const service = serviceOf(task);
  return service?.name ? { group: "service", ...whoOf(service.roles, false) } : undefined;
}

function groupOf(catalogue: Catalogue, use: BehaviorUse): BlockGroup {
  const [role] = use.roles;
  if (role?.kind === "team" || use.type === "team") return "team";
  if (use.type === "payload") return "payload";
  const behavior = catalogue.meant(use);
  const [candidate] = behavior ? catalogue.candidates(behavior) : [];
  return catalogue.domainOf(role?.resource ?? "") ?? candidate?.domain ?? "ground";
}

function whoOf(roles: readonly Role[], isNeeded: boolean): { who: string | undefined; missing: boolean } {
  const named = roles.filter((role) => role.resource !== "");
  if (named.length > 0) {
    return { who: named.map((role) => role.resource).join(", "), missing: false };
  }
  return isNeeded && roles.some((role) => !role.optional)
    ? { who: strings.editor.blocks.nobody, missing: true }
    : { who: undefined, missing: false };
}

function svg(name: string, attributes: Record<string, string | number>): SVGElement {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, String(value));
  return made;
}

function icon(group: BlockGroup): SVGElement {
  return svg("path", {
    d: ICONS[group],
    fill: COLORS[group],
    "fill-rule": "evenodd",
    transform: "translate(4 3) scale(0.8)",
  });
}

/** A strip along the lower edge: white on the colour of the kind; dashed where nobody is chosen. */
function strip({ width, height }: { width: number; height: number }, drawn: Drawn): SVGElement {
  const top = height - STRIP_HEIGHT;
  const color = COLORS[drawn.group];
  const made = svg("g", {});
  const outline =
    `M1 ${top}H${width - 1}V${height - CORNER}a${CORNER - 1} ${CORNER - 1} 0 0 1 -${CORNER - 1} ` +
    `${CORNER - 1}H${CORNER}a${CORNER - 1} ${CORNER - 1} 0 0 1 -${CORNER - 1} -${CORNER - 1}z`;
  const paint = drawn.missing
    ? { fill: "#fff4f3", stroke: "#b3261e", "stroke-dasharray": "3 2" }
    : { fill: color };
  made.append(svg("path", { d: outline, ...paint }));
  const label = svg("text", {
    x: width / 2,
    y: top + STRIP_HEIGHT / 2 + 3.5,
    "text-anchor": "middle",
    "font-family": "Arial, sans-serif",
    "font-size": 10,
    "font-weight": "bold",
    fill: drawn.missing ? "#b3261e" : "#ffffff",
  });
  label.textContent = shortened(drawn.who ?? "");
  made.append(label);
  return made;
}

function shortened(who: string): string {
  return who.length > SHOWN_CHARACTERS ? `${who.slice(0, SHOWN_CHARACTERS - 1)}…` : who;
}
