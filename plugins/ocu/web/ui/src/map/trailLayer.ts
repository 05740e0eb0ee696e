// Trails on a canvas that is larger than the map. What is new is added to it; all is drawn again only
// where the map goes beyond it, or zooms.
import L from "leaflet";
import { MapCanvas } from "./mapCanvas";
import { TrailPoints, type WorldPoint } from "./trailPoints";

const COLOUR = "#3a7bd0";
const WIDTH_PX = 2;
const EQUATOR_M = 40_075_017;
const WORLD_PX = 256;
/** Beyond each edge of the map, as a share of it. */
const MARGIN = 0.3;
/** A line goes on when it is so long: a trail of years is not drawn point by point. */
const LEAST_PX = 1;
/** What was left out of trails stays drawn so long. */
const TRIM_MS = 5000;

type Segment = readonly [WorldPoint, WorldPoint];

export class TrailLayer extends MapCanvas {
  private readonly trails = new Map<string, TrailPoints>();
  private fresh: Segment[] = [];
  private isWhole = false;
  private trimmed_ms = 0;
  private zoom = NaN;
  /** Of the canvas, in the pixels of the map's layers. */
  private corner = L.point(0, 0);
  private size = L.point(0, 0);

  constructor(private readonly most: number) {
    super("overlayPane", "trail-canvas");
  }

  /** Where a vehicle has been, drawn again. */
  replace(resource: string, pieces: readonly (readonly L.LatLngTuple[])[]): void {
    this.trailOf(resource).replace(pieces.map((piece) => piece.map(worldOf)));
    this.reset();
  }

  /** Where a vehicle is now, `since_s` after it was where its trail ends. */
  extend(resource: string, at: L.LatLngTuple, since_s: number, longest_s: number): void {
    const to = worldOf(at);
    const trail = this.trailOf(resource);
    const from = trail.extend(to, metresOf(at), since_s, longest_s);
    const now_ms = performance.now();
    if (trail.trim() && now_ms - this.trimmed_ms > TRIM_MS) {
      this.trimmed_ms = now_ms;
      this.reset();
    }
    if (!from || !this.map) return;
    this.fresh.push([from, to]);
    this.ask();
  }

  forget(resource: string): void {
    if (this.trails.delete(resource)) this.reset();
  }

  private trailOf(resource: string): TrailPoints {
    const trail = this.trails.get(resource) ?? new TrailPoints(this.most);
    this.trails.set(resource, trail);
    return trail;
  }

  protected reset(): void {
    this.isWhole = false;
    this.ask();
  }

  /** Draw again if the map shows what the canvas does not have. */
  protected moved(): void {
    const { map } = this;
    if (!map) return;
    const [from, to] = [this.corner, this.corner.add(this.size)];
    const seen = map.containerPointToLayerPoint([0, 0]);
    const end = seen.add(map.getSize());
    const isOnIt = from.x <= seen.x && from.y <= seen.y && to.x >= end.x && to.y >= end.y;
    if (!isOnIt || map.getZoom() !== this.zoom) this.reset();
  }

  protected draw(map: L.Map, context: CanvasRenderingContext2D): void {
    if (!this.isWhole) {
      const seen = map.getSize();
      this.size = seen.multiplyBy(1 + 2 * MARGIN).round();
      this.corner = map.containerPointToLayerPoint(seen.multiplyBy(-MARGIN)).round();
      this.zoom = map.getZoom();
      this.lay(context, this.corner, this.size);
    }
    const scale = map.getZoomScale(this.zoom, 0);
    const origin = map.getPixelOrigin().add(this.corner);
    context.strokeStyle = COLOUR;
    context.lineWidth = WIDTH_PX;
    context.lineJoin = context.lineCap = "round";
    context.beginPath();
    if (this.isWhole) {
      for (const [from, to] of this.fresh) {
        context.moveTo(from[0] * scale - origin.x, from[1] * scale - origin.y);
        context.lineTo(to[0] * scale - origin.x, to[1] * scale - origin.y);
      }
    } else {
      context.clearRect(0, 0, this.size.x, this.size.y);
      for (const { pieces } of this.trails.values()) {
        for (const piece of pieces) this.trace(context, piece, scale, origin);
      }
    }
    context.stroke();
    this.fresh = [];
    this.isWhole = true;
  }

  private trace(
    context: CanvasRenderingContext2D,
    piece: readonly number[],
    scale: number,
    origin: L.Point,
  ): void {
    let [drawn_x, drawn_y] = [NaN, NaN];
    for (let index = 0; index < piece.length; index += 2) {
      const x = piece[index]! * scale - origin.x;
      const y = piece[index + 1]! * scale - origin.y;
      const isLast = index === piece.length - 2;
      if (index === 0) context.moveTo(x, y);
      else if (isLast || Math.abs(x - drawn_x) + Math.abs(y - drawn_y) >= LEAST_PX) {
        context.lineTo(x, y);
      } else continue;
      [drawn_x, drawn_y] = [x, y];
    }
  }
}

/** Of a pixel at zoom 0. */
const metresOf = ([latitude]: L.LatLngTuple): number =>
  (EQUATOR_M / WORLD_PX) * Math.cos((latitude * Math.PI) / 180);

function worldOf(at: L.LatLngTuple): WorldPoint {
  const { x, y } = L.CRS.EPSG3857.latLngToPoint(L.latLng(at), 0);
  return [x, y];
}
