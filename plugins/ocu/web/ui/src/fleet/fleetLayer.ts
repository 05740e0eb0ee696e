// The vehicles of the fleet on a canvas above the map: a thousand are no more work for the browser
// than what is seen of them.
import L from "leaflet";
import { heading_deg } from "../shared/format";
import { DOMAIN_PATHS } from "../operate/vehicles/DomainSymbol";
import { Clusters, worstOf, type Mark } from "./clusters";
import type { Domain, Health, Row } from "./rows";

const SYMBOL_PX = 26;
const HIT_PX = 20;
const CLUSTER_PX = 17;
const LABEL_PX = 14;
/** Letters are about so wide: to measure each text of each frame takes too long. */
const LETTER_PX = 7;

interface Drawn {
  mark: Mark;
  x: number;
  y: number;
}

type Colours = Record<Health | "ink" | "halo" | "selected" | "paper", string>;

const shapes = new Map<Domain, Path2D>();

function shapeOf(domain: Domain): Path2D {
  const known = shapes.get(domain);
  if (known) return known;
  const made = new Path2D(DOMAIN_PATHS[domain]);
  shapes.set(domain, made);
  return made;
}

/** What is told apart by its shape too. */
const BADGES: Partial<Record<Health, string>> = {
  lost: "✕",
  unheard: "?",
  notReady: "!",
  lowBattery: "▾",
  degraded: "~",
};

export class FleetLayer extends L.Layer {
  private readonly clusters = new Clusters();
  private canvas: HTMLCanvasElement | null = null;
  private map: L.Map | null = null;
  private drawn: Drawn[] = [];
  private wanted = 0;
  private colours: Colours | null = null;
  private selected: ReadonlySet<string> = new Set();
  private destination: [number, number] | null = null;
  private going: readonly string[] = [];

  override onAdd(map: L.Map): this {
    this.map = map;
    this.canvas = L.DomUtil.create("canvas", "fleet-canvas", map.getPanes().markerPane);
    map.on("move zoom resize viewreset", this.redraw, this);
    this.redraw();
    return this;
  }

  override onRemove(map: L.Map): this {
    map.off("move zoom resize viewreset", this.redraw, this);
    cancelAnimationFrame(this.wanted);
    this.wanted = 0;
    this.canvas?.remove();
    this.canvas = null;
    this.map = null;
    return this;
  }

  load(rows: readonly Row[]): void {
    this.clusters.load(rows);
    this.redraw();
  }

  choose(selected: ReadonlySet<string>): void {
    this.selected = selected;
    this.redraw();
  }

  /** Lines from vehicles to where they would go. */
  aim(destination: [number, number] | null, going: readonly string[]): void {
    this.destination = destination;
    this.going = going;
    this.redraw();
  }

  /** The theme has changed. */
  recolour(): void {
    this.colours = null;
    this.redraw();
  }

  position(resource: string): L.LatLngTuple | null {
    const row = this.clusters.known.find(({ id }) => id === resource);
    return row ? [row.latitude!, row.longitude!] : null;
  }

  positions(): L.LatLngTuple[] {
    return this.clusters.known.map(({ latitude, longitude }) => [latitude!, longitude!]);
  }

  zoomOf(cluster: number): number {
    return this.clusters.zoomOf(cluster);
  }

  /** What is drawn nearest to a place of the container; null: nothing is near. */
  at({ x, y }: L.Point): Mark | null {
    let best: Drawn | null = null;
    let least = HIT_PX;
    for (const each of this.drawn) {
      const off = Math.hypot(each.x - x, each.y - y);
      if (off < least) [best, least] = [each, off];
    }
    return best?.mark ?? null;
  }

  /** Once, when the browser is about to paint, however often it is asked for. */
  private redraw(): void {
    this.wanted ||= requestAnimationFrame(() => {
      this.wanted = 0;
      this.draw();
    });
  }

  private draw(): void {
    const { map, canvas } = this;
    const context = canvas?.getContext("2d");
    if (!map || !canvas || !context) return;
    const size = map.getSize();
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [Math.round(size.x * ratio), Math.round(size.y * ratio)];
    if (canvas.width !== width || canvas.height !== height) {
      [canvas.width, canvas.height] = [width, height];
      [canvas.style.width, canvas.style.height] = [`${size.x}px`, `${size.y}px`];
    }
    L.DomUtil.setPosition(canvas, map.containerPointToLayerPoint([0, 0]));
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, size.x, size.y);
    const colours = (this.colours ??= coloursOf(map.getContainer()));
    const bounds = map.getBounds().pad(0.1);
    const marks = this.clusters.marks(
      [bounds.getWest(), bounds.getSouth(), bounds.getEast(), bounds.getNorth()],
      map.getZoom(),
    );
    this.drawn = marks.map((mark) => {
      const { x, y } = map.latLngToContainerPoint([mark.latitude, mark.longitude]);
      return { mark, x, y };
    });
    this.drawAim(context, map, colours);
    for (const each of this.drawn) this.drawMark(context, each, colours);
    this.drawNames(context, colours);
  }

  private drawMark(context: CanvasRenderingContext2D, { mark, x, y }: Drawn, colours: Colours) {
    context.save();
    context.translate(x, y);
    if (mark.kind === "cluster") drawCluster(context, mark, colours);
    else drawVehicle(context, mark.row, this.selected.has(mark.row.id), colours);
    context.restore();
  }

  /** Names where they have room; those of selected vehicles first. */
  private drawNames(context: CanvasRenderingContext2D, colours: Colours): void {
    const taken: [number, number, number, number][] = [];
    context.font = `600 12px ${getComputedStyle(this.canvas!).fontFamily}`;
    context.textAlign = "center";
    context.textBaseline = "top";
    context.lineWidth = 3;
    context.lineJoin = "round";
    const vehicles = this.drawn.filter(({ mark }) => mark.kind === "vehicle");
    const isChosen = ({ mark }: Drawn) => mark.kind === "vehicle" && this.selected.has(mark.row.id);
    for (const each of [
      ...vehicles.filter(isChosen),
      ...vehicles.filter((other) => !isChosen(other)),
    ]) {
      if (each.mark.kind !== "vehicle") continue;
      const { id } = each.mark.row;
      const half = (id.length * LETTER_PX) / 2;
      const box: [number, number, number, number] = [
        each.x - half,
        each.y + LABEL_PX,
        each.x + half,
        each.y + LABEL_PX + 14,
      ];
      if (taken.some((other) => overlap(box, other))) continue;
      taken.push(box);
      context.strokeStyle = colours.halo;
      context.strokeText(id, each.x, box[1]);
      context.fillStyle = colours.ink;
      context.fillText(id, each.x, box[1]);
    }
  }

  private drawAim(context: CanvasRenderingContext2D, map: L.Map, colours: Colours): void {
    if (!this.destination) return;
    const to = map.latLngToContainerPoint(this.destination);
    context.strokeStyle = colours.selected;
    context.lineWidth = 2;
    context.setLineDash([6, 5]);
    context.beginPath();
    for (const resource of this.going) {
      const from = this.position(resource);
      if (!from) continue;
      const { x, y } = map.latLngToContainerPoint(from);
      context.moveTo(x, y);
      context.lineTo(to.x, to.y);
    }
    context.stroke();
    context.setLineDash([]);
    context.beginPath();
    context.arc(to.x, to.y, 8, 0, 2 * Math.PI);
    context.moveTo(to.x - 13, to.y);
    context.lineTo(to.x + 13, to.y);
    context.moveTo(to.x, to.y - 13);
    context.lineTo(to.x, to.y + 13);
    context.stroke();
  }
}

function drawVehicle(
  context: CanvasRenderingContext2D,
  { domain, yaw_rad, health, manned }: Row,
  isSelected: boolean,
  colours: Colours,
): void {
  if (isSelected) {
    context.beginPath();
    context.arc(0, 0, SYMBOL_PX / 2 + 5, 0, 2 * Math.PI);
    context.strokeStyle = colours.selected;
    context.lineWidth = 3;
    context.stroke();
  }
  context.save();
  if (yaw_rad !== null) context.rotate((heading_deg(yaw_rad) * Math.PI) / 180);
  context.scale(SYMBOL_PX / 24, SYMBOL_PX / 24);
  context.translate(-12, -12);
  const shape = shapeOf(domain);
  const isHollow = health === "lost" || health === "unheard" || manned;
  context.fillStyle = isHollow ? colours.paper : colours[health];
  context.strokeStyle = isHollow ? colours[health] : colours.paper;
  context.lineWidth = 1.5;
  context.fill(shape);
  context.stroke(shape);
  context.restore();
  const badge = BADGES[health];
  if (badge) drawBadge(context, badge, colours[health], colours.paper);
}

function drawBadge(context: CanvasRenderingContext2D, text: string, fill: string, ink: string) {
  const [x, y] = [SYMBOL_PX / 2, -SYMBOL_PX / 2 + 2];
  context.beginPath();
  context.arc(x, y, 7.5, 0, 2 * Math.PI);
  context.fillStyle = fill;
  context.fill();
  context.strokeStyle = ink;
  context.lineWidth = 1.5;
  context.stroke();
  context.fillStyle = ink;
  context.font = "700 11px sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillText(text, x, y + 0.5);
}

function drawCluster(
  context: CanvasRenderingContext2D,
  { count, healths }: Extract<Mark, { kind: "cluster" }>,
  colours: Colours,
): void {
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
  const worst = worstOf(healths);
  const badge = BADGES[worst];
  if (badge) drawBadge(context, badge, colours[worst], colours.paper);
}

const overlap = (
  [left, top, right, bottom]: [number, number, number, number],
  [otherLeft, otherTop, otherRight, otherBottom]: [number, number, number, number],
): boolean => left < otherRight && right > otherLeft && top < otherBottom && bottom > otherTop;

/** From the style sheet: they differ between themes, and where colours are forced. */
function coloursOf(element: HTMLElement): Colours {
  const style = getComputedStyle(element);
  const colour = (name: string) => style.getPropertyValue(name).trim();
  return {
    ok: colour("--fleet-ok"),
    degraded: colour("--fleet-degraded"),
    lowBattery: colour("--fleet-low"),
    notReady: colour("--fleet-not-ready"),
    unheard: colour("--fleet-unheard"),
    lost: colour("--fleet-lost"),
    ink: colour("--fleet-ink"),
    halo: colour("--fleet-halo"),
    selected: colour("--fleet-selected"),
    paper: colour("--fleet-paper"),
  };
}
