// Marks what is wrong on the canvas: an outline, and a badge with how many findings there are.
import type { Finding } from "../../shared/types";
import { fill, strings } from "../../strings";
import type { Canvas, ElementRegistry, Overlays } from "./services";

const LAYER = "m2pem-findings";
const CLASSES = { error: "m2-has-error", warning: "m2-has-warning" } as const;

export class FindingMarks {
  static readonly $inject = ["canvas", "elementRegistry", "overlays"];
  private marked: { id: string; marker: string }[] = [];

  constructor(
    private readonly canvas: Canvas,
    private readonly elementRegistry: ElementRegistry,
    private readonly overlays: Overlays,
  ) {}

  show(findings: readonly Finding[], choose: (element: string) => void): void {
    this.clear();
    for (const id of new Set(findings.map((each) => each.element))) {
      const group = findings.filter((each) => each.element === id);
      const element = this.elementRegistry.get(id);
      if (!element || !element.parent) continue;
      const severity = group.some((each) => each.severity === "error") ? "error" : "warning";
      const marker = CLASSES[severity];
      this.canvas.addMarker(id, marker);
      this.marked.push({ id, marker });
      const position = "waypoints" in element ? { top: -18, left: 0 } : { top: -10, right: 10 };
      this.overlays.add(id, LAYER, { position, html: badge(id, severity, group, choose) });
    }
  }

  private clear(): void {
    this.overlays.remove({ type: LAYER });
    for (const { id, marker } of this.marked) {
      if (this.elementRegistry.get(id)) this.canvas.removeMarker(id, marker);
    }
    this.marked = [];
  }
}

function badge(
  id: string,
  severity: Finding["severity"],
  findings: readonly Finding[],
  choose: (element: string) => void,
): HTMLElement {
  const made = document.createElement("button");
  made.type = "button";
  made.className = `m2-badge m2-badge-${severity}`;
  made.textContent = String(findings.length);
  made.title = findings.map((each) => each.message).join("\n");
  made.setAttribute(
    "aria-label",
    fill(strings.editor.problems.badge, { count: findings.length, element: id }),
  );
  made.tabIndex = -1;
  made.addEventListener("click", () => choose(id));
  return made;
}

export const findingMarksModule = {
  __init__: ["findingMarks"],
  findingMarks: ["type", FindingMarks],
};
