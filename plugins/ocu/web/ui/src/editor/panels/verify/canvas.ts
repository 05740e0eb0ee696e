// The diagram shows what is looked at in a report: a run step by step, and what is never reached.
import { effect } from "@preact/signals";
import { fill, strings } from "../../../strings";
import type { EditorContext } from "../panel";
import { frameAt, type Frame } from "./walk";
import type { Verification } from "./verification";

const LAYER = "verification";
const UNREACHED = "m2v-unreached";
const OVERLAYS = "m2v-step";
const HATCH = "m2v-hatch";
const SVG = "http://www.w3.org/2000/svg";
const PAUSE_MS = 200;

const words = strings.verify.canvas;

/** Follows a verification until what it gives back is called. */
export function followOnCanvas(editor: EditorContext, verification: Verification): () => void {
  const bus = editor.service("eventBus");
  const redraw = () => draw(editor, verification);
  const ends = [effect(redraw), followChanges(editor, verification)];
  bus.on("import.done", redraw);
  bus.on("root.set", redraw);
  return () => {
    for (const end of ends) end();
    bus.off("import.done", redraw);
    bus.off("root.set", redraw);
  };
}

function followChanges(editor: EditorContext, verification: Verification): () => void {
  let timer: ReturnType<typeof setTimeout> | undefined;
  const end = editor.changes.subscribe(() => {
    clearTimeout(timer);
    timer = setTimeout(() => void verification.compare(editor), PAUSE_MS);
  });
  return () => {
    clearTimeout(timer);
    end();
  };
}

function draw(editor: EditorContext, verification: Verification): void {
  const old = verification.isStale.value ? " m2v-old" : "";
  const violation = verification.opened.value;
  const frame = violation && frameAt(violation, verification.step.value);
  const unreached = verification.made.value?.report.unreached ?? [];
  if (unreached.length > 0) provideHatch(editor);
  const classes = new Map(Object.entries(frame?.classes ?? {}));
  for (const id of unreached) classes.set(id, `${classes.get(id) ?? ""} ${UNREACHED}`.trim());
  editor.mark(LAYER, Object.fromEntries([...classes].map(([id, names]) => [id, names + old])));
  editor.service("overlays").remove({ type: OVERLAYS });
  if (violation && frame) showBadges(editor, frame, violation.text, old);
}

function showBadges(editor: EditorContext, frame: Frame, reason: string, old: string): void {
  for (const [element, numbers] of frame.numbers) {
    const label = numbers
      .map(({ step, repeats }) => (repeats ? `↻${step}` : String(step)))
      .join(" · ");
    const now = numbers.some((each) => each.now) ? " m2v-number-now" : "";
    const steps = numbers.map(({ step }) => step).join(", ");
    badge(editor, element, `m2v-number${now}${old}`, label, fill(words.step, { steps }), "top");
  }
  for (const element of frame.stuck) {
    badge(editor, element, `m2v-reason${old}`, reason, reason, "bottom");
  }
}

type Shape = { x: number; y: number; width: number; height: number };
type Connection = { waypoints: { x: number; y: number }[] };

function badge(
  editor: EditorContext,
  id: string,
  className: string,
  text: string,
  title: string,
  side: "top" | "bottom",
): void {
  const element = editor.service("elementRegistry").get(id) as
    Partial<Shape & Connection> | undefined;
  if (!element || (element.width === undefined && !element.waypoints)) return;
  const html = document.createElement("div");
  html.className = className;
  html.textContent = text;
  html.title = title;
  editor.service("overlays").add(id, OVERLAYS, { position: positionOf(element, side), html });
}

function positionOf(element: Partial<Shape & Connection>, side: "top" | "bottom") {
  const { waypoints } = element;
  if (!waypoints) return side === "top" ? { top: -12, left: -12 } : { bottom: -4, left: 0 };
  const xs = waypoints.map(({ x }) => x);
  const ys = waypoints.map(({ y }) => y);
  const from = waypoints[(waypoints.length >> 1) - 1]!;
  const to = waypoints[waypoints.length >> 1]!;
  return {
    left: (from.x + to.x) / 2 - Math.min(...xs) - 10,
    top: (from.y + to.y) / 2 - Math.min(...ys) + (side === "top" ? -10 : 8),
  };
}

/** The pattern that CSS fills with what is never reached; it must stand in the canvas's own SVG. */
function provideHatch(editor: EditorContext): void {
  const svg = editor.service("canvas").getContainer().querySelector("svg");
  if (!svg || svg.querySelector(`#${HATCH}`)) return;
  const defs = document.createElementNS(SVG, "defs");
  const attributes = { id: HATCH, width: "8", height: "8", patternUnits: "userSpaceOnUse" };
  const pattern = made("pattern", { ...attributes, patternTransform: "rotate(45)" });
  pattern.append(
    made("rect", { width: "8", height: "8", fill: "#f3f4f6" }),
    made("rect", { width: "2", height: "8", fill: "#8b95a1" }),
  );
  defs.append(pattern);
  svg.append(defs);
}

function made(name: string, attributes: Record<string, string>): SVGElement {
  const element = document.createElementNS(SVG, name) as SVGElement;
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  return element;
}
