// How vehicles, and clusters of them, are drawn on a canvas.
import type { Fleet } from "../shared/types";
import { heading_deg } from "../shared/format";
import { DOMAIN_PATHS } from "../operate/vehicles/DomainSymbol";
import { rankOf, type Health } from "./health";

type Domain = Fleet["vehicles"][number]["domain"];

export interface MapVehicle {
  id: string;
  domain: Domain;
  manned: boolean;
  yaw_rad: number | null;
  health: Health;
}

/** How many have each health. */
export type Counted = Partial<Record<Health, number>>;

/** Of those in a cluster. */
export const worstOf = (healths: Counted): Health =>
  (Object.keys(healths) as Health[]).reduce((worst, each) =>
    rankOf(each) > rankOf(worst) ? each : worst,
  );

export type Colours = Record<Health | "ink" | "halo" | "selected" | "paper", string>;

const SYMBOL_PX = 26;
/** A picture of a symbol has room for its badge. */
const PICTURE_PX = 44;
const CLUSTER_PX = 17;
/** Pictures are kept for so many headings of a turn: no person sees a difference. */
const HEADINGS = 72;

/** What differs by its shape too. */
const BADGES: Partial<Record<Health, string>> = {
  lost: "✕",
  unheard: "?",
  unknown: "?",
  notReady: "!",
  lowBattery: "▾",
  degraded: "~",
};

/** Where it is now is not known. */
const HOLLOW: ReadonlySet<Health> = new Set(["lost", "unheard", "unknown"]);

/** From the style sheet: they differ between themes, and where colours are forced. */
export function coloursOf(element: HTMLElement): Colours {
  const style = getComputedStyle(element);
  const colour = (name: string) => style.getPropertyValue(`--vehicle-${name}`).trim();
  return {
    ok: colour("ok"),
    degraded: colour("degraded"),
    lowBattery: colour("low"),
    notReady: colour("not-ready"),
    unheard: colour("unheard"),
    unknown: colour("unheard"),
    lost: colour("lost"),
    ink: colour("ink"),
    halo: colour("halo"),
    selected: colour("selected"),
    paper: colour("paper"),
  };
}

/**
 * Draws symbols in the colours of one theme. Each is drawn once, and then copied: without a
 * graphics card that takes a tenth of the time.
 */
export class VehicleSymbols {
  private readonly pictures = new Map<string, HTMLCanvasElement>();
  private readonly shapes = new Map<Domain, Path2D>();

  constructor(
    readonly colours: Colours,
    readonly ratio: number,
  ) {}

  vehicle(
    context: CanvasRenderingContext2D,
    { domain, yaw_rad, health, manned }: MapVehicle,
    isSelected: boolean,
    [x, y]: readonly [number, number],
  ): void {
    const turned = yaw_rad === null ? 0 : Math.round((heading_deg(yaw_rad) / 360) * HEADINGS);
    const step = turned % HEADINGS;
    const key = `${domain} ${health} ${manned} ${isSelected} ${step}`;
    let picture = this.pictures.get(key);
    if (!picture) {
      picture = this.picture(domain, health, manned, isSelected, (step / HEADINGS) * 2 * Math.PI);
      this.pictures.set(key, picture);
    }
    // On whole pixels of the screen it is copied as it is.
    const left = Math.round((x - PICTURE_PX / 2) * this.ratio) / this.ratio;
    const top = Math.round((y - PICTURE_PX / 2) * this.ratio) / this.ratio;
    context.drawImage(picture, left, top, PICTURE_PX, PICTURE_PX);
  }

  cluster(
    context: CanvasRenderingContext2D,
    { count, healths }: { count: number; healths: Counted },
    [x, y]: readonly [number, number],
  ): void {
    const { colours } = this;
    context.save();
    context.translate(x, y);
    context.beginPath();
    context.arc(0, 0, CLUSTER_PX, 0, 2 * Math.PI);
    context.fillStyle = colours.paper;
    context.fill();
    context.lineWidth = 5;
    // The ring shows how many have which health.
    let from = -Math.PI / 2;
    for (const [health, some] of Object.entries(healths)) {
      const to = from + (2 * Math.PI * some) / count;
      context.beginPath();
      context.arc(0, 0, CLUSTER_PX, from, to);
      context.strokeStyle = colours[health as Health];
      context.stroke();
      from = to;
    }
    context.fillStyle = colours.ink;
    context.font = "700 13px sans-serif";
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillText(String(count), 0, 0.5);
    this.badge(context, worstOf(healths));
    context.restore();
  }

  private picture(
    domain: Domain,
    health: Health,
    manned: boolean,
    isSelected: boolean,
    heading_rad: number,
  ): HTMLCanvasElement {
    const { colours, ratio } = this;
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = Math.ceil(PICTURE_PX * ratio);
    const context = canvas.getContext("2d")!;
    context.scale(ratio, ratio);
    context.translate(PICTURE_PX / 2, PICTURE_PX / 2);
    if (isSelected) {
      context.beginPath();
      context.arc(0, 0, SYMBOL_PX / 2 + 5, 0, 2 * Math.PI);
      context.strokeStyle = colours.selected;
      context.lineWidth = 3;
      context.stroke();
    }
    context.save();
    context.rotate(heading_rad);
    context.scale(SYMBOL_PX / 24, SYMBOL_PX / 24);
    context.translate(-12, -12);
    const shape = this.shapeOf(domain);
    const isHollow = HOLLOW.has(health) || manned;
    context.fillStyle = isHollow ? colours.paper : colours[health];
    context.strokeStyle = isHollow ? colours[health] : colours.paper;
    context.lineWidth = 1.5;
    context.fill(shape);
    context.stroke(shape);
    context.restore();
    this.badge(context, health);
    return canvas;
  }

  private shapeOf(domain: Domain): Path2D {
    const shape = this.shapes.get(domain) ?? new Path2D(DOMAIN_PATHS[domain]);
    this.shapes.set(domain, shape);
    return shape;
  }

  private badge(context: CanvasRenderingContext2D, health: Health): void {
    const text = BADGES[health];
    if (!text) return;
    const { colours } = this;
    const [x, y] = [SYMBOL_PX / 2, -SYMBOL_PX / 2 + 2];
    context.beginPath();
    context.arc(x, y, 7.5, 0, 2 * Math.PI);
    context.fillStyle = colours[health];
    context.fill();
    context.strokeStyle = colours.paper;
    context.lineWidth = 1.5;
    context.stroke();
    context.fillStyle = colours.paper;
    context.font = "700 11px sans-serif";
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillText(text, x, y + 0.5);
  }
}
