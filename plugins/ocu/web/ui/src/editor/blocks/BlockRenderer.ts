// Draws tasks that command something: what kind of thing, and who does it.
import type BpmnRenderer from "bpmn-js/lib/draw/BpmnRenderer";
import BaseRenderer from "diagram-js/lib/draw/BaseRenderer";
import { strings } from "../../strings";
import { behaviorOf, isByNeed, serviceOf, type BehaviorUse, type Role } from "../moddle/behavior";
import { isA, type ModdleElement } from "../moddle/moddle";
import type { Catalogue } from "../session/catalogue";
import type { Element, EventBus } from "../session/services";
import type { BlockGroup } from "./blocks";
import { COLORS, ICONS } from "./icons";

const BEFORE_BPMN = 1500;
const SVG = "http://www.w3.org/2000/svg";
const BAR_HEIGHT = 18;
const CORNER = 10;
const ICON_WIDTH = 22;
const CHARACTER_WIDTH = 6;
const MISSING = "#b3261e";

interface Drawn {
  group: BlockGroup;
  /** The resource that does it; undefined: none is needed. */
  who: string | undefined;
  missing: boolean;
}

interface Size {
  width: number;
  height: number;
}

type Handler = (gfx: SVGElement, element: Drawable, attrs?: object) => SVGElement;
type Drawable = Parameters<BaseRenderer["drawShape"]>[1];

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

  override drawShape(gfx: SVGElement, element: Drawable): SVGElement {
    const drawn = drawnOf(this.catalogue, element.businessObject as ModdleElement)!;
    const task = this.bpmnRenderer.handlers["bpmn:Task"]!(gfx, element);
    gfx.append(bar(element as unknown as Size, drawn));
    return task;
  }

  override getShapePath(element: Drawable): string {
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

function whoOf(
  roles: readonly Role[],
  isNeeded: boolean,
): { who: string | undefined; missing: boolean } {
  const filled = roles.filter((role) => role.resource !== "" || isByNeed(role));
  if (filled.length > 0) {
    const { byNeed } = strings.editor.blocks;
    return { who: filled.map((role) => role.resource || byNeed).join(", "), missing: false };
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

/** A bar along the upper edge: white on the colour of the kind; hollow where nothing is chosen. */
function bar({ width }: Size, drawn: Drawn): SVGElement {
  const color = COLORS[drawn.group];
  const made = svg("g", {});
  const inner = CORNER - 1;
  const outline =
    `M1 ${BAR_HEIGHT}V${CORNER}a${inner} ${inner} 0 0 1 ${inner} -${inner}H${width - CORNER}` +
    `a${inner} ${inner} 0 0 1 ${inner} ${inner}V${BAR_HEIGHT}z`;
  const hollow = { fill: "#fff4f3", stroke: MISSING, "stroke-dasharray": "3 2" };
  made.append(svg("path", { d: outline, ...(drawn.missing ? hollow : { fill: color }) }));
  made.append(icon(drawn.group, drawn.missing ? MISSING : "#ffffff"));
  if (drawn.who) made.append(name(drawn.who, width, drawn.missing ? MISSING : "#ffffff"));
  return made;
}

function icon(group: BlockGroup, fill: string): SVGElement {
  return svg("path", {
    d: ICONS[group],
    fill,
    "fill-rule": "evenodd",
    transform: "translate(6 2.5) scale(0.6)",
  });
}

function name(who: string, width: number, fill: string): SVGElement {
  const made = svg("text", {
    x: ICON_WIDTH + (width - ICON_WIDTH) / 2 - 4,
    y: BAR_HEIGHT - 5.5,
    "text-anchor": "middle",
    "font-family": "Arial, sans-serif",
    "font-size": 10.5,
    "font-weight": "bold",
    fill,
  });
  const room = Math.floor((width - ICON_WIDTH) / CHARACTER_WIDTH);
  made.textContent = who.length > room ? `${who.slice(0, room - 1)}…` : who;
  return made;
}
