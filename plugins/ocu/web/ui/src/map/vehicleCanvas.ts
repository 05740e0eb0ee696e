// Vehicles on a canvas above the map: a thousand are no more work for the browser than what is seen
// of them. Each change is drawn with the next picture of the browser, however many there are.
import L from "leaflet";
import { theme } from "../shared/theme";
import { MapCanvas } from "./mapCanvas";
import { roomFor } from "./names";
import {
  coloursOf,
  VehicleSymbols,
  type Colours,
  type Counted,
  type MapVehicle,
} from "./vehicleSymbols";
import "./vehicles.css";

const HIT_PX = 20;
const LABEL_PX = 14;
/** Symbols at the edge are partly seen. */
const EDGE_PX = 24;

export type Mark =
  | { kind: "vehicle"; vehicle: MapVehicle; latitude: number; longitude: number }
  | {
      kind: "cluster";
      id: number;
      count: number;
      healths: Counted;
      latitude: number;
      longitude: number;
    };

interface Drawn {
  mark: Mark;
  x: number;
  y: number;
}

export interface VehicleCanvasSource {
  /** What there is to draw within bounds, degrees: west, south, east, north. */
  marks(bounds: [number, number, number, number], zoom: number): readonly Mark[];
  /** What is drawn below the vehicles. */
  under?(context: CanvasRenderingContext2D, colours: Colours): void;
  /** All is drawn. */
  done?(): void;
}

export class VehicleCanvas extends MapCanvas {
  private drawn: Drawn[] = [];
  private symbols: VehicleSymbols | null = null;
  private selected: ReadonlySet<string> = new Set();
  private hasNames = true;
  private font = "";
  private readonly widths = new Map<string, number>();
  private stops: (() => void)[] = [];

  constructor(private readonly source: VehicleCanvasSource) {
    super("markerPane", "vehicle-canvas");
  }

  override onAdd(map: L.Map): this {
    super.onAdd(map);
    map.on("mousemove", this.hover, this);
    const forced = matchMedia("(forced-colors: active)");
    const recolour = () => this.recolour();
    forced.addEventListener("change", recolour);
    this.stops = [
      () => forced.removeEventListener("change", recolour),
      // The style of a theme is that of the next frame.
      theme.subscribe(() => void requestAnimationFrame(recolour)),
    ];
    return this;
  }

  override onRemove(map: L.Map): this {
    map.off("mousemove", this.hover, this);
    for (const stop of this.stops) stop();
    return super.onRemove(map);
  }

  choose(selected: ReadonlySet<string>): void {
    this.selected = selected;
    this.redraw();
  }

  showNames(on: boolean): void {
    this.hasNames = on;
    this.redraw();
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

  redraw(): void {
    this.ask();
  }

  protected moved(): void {
    this.ask();
  }

  protected reset(): void {
    this.ask();
  }

  /** The theme has changed. */
  private recolour(): void {
    this.symbols = null;
    this.redraw();
  }

  private hover({ containerPoint }: L.LeafletMouseEvent): void {
    this.map?.getContainer().classList.toggle("map-over-vehicle", this.at(containerPoint) !== null);
  }

  protected draw(map: L.Map, context: CanvasRenderingContext2D): void {
    const size = map.getSize();
    const ratio = this.lay(context, map.containerPointToLayerPoint([0, 0]), size);
    context.clearRect(0, 0, size.x, size.y);
    const symbols = this.symbolsFor(map.getContainer(), ratio);
    this.drawn = this.seen(map, size);
    this.source.under?.(context, symbols.colours);
    for (const { mark, x, y } of this.drawn) {
      if (mark.kind === "cluster") symbols.cluster(context, mark, [x, y]);
      else symbols.vehicle(context, mark.vehicle, this.selected.has(mark.vehicle.id), [x, y]);
    }
    if (this.hasNames) this.drawNames(context, symbols.colours);
    this.source.done?.();
  }

  private symbolsFor(element: HTMLElement, ratio: number): VehicleSymbols {
    if (this.symbols?.ratio !== ratio) {
      this.symbols = new VehicleSymbols(coloursOf(element), ratio);
      this.font = `600 12px ${getComputedStyle(element).getPropertyValue("--font") || "sans-serif"}`;
      this.widths.clear();
    }
    return this.symbols!;
  }

  private seen(map: L.Map, size: L.Point): Drawn[] {
    const bounds = map.getBounds().pad(0.1);
    const marks = this.source.marks(
      [bounds.getWest(), bounds.getSouth(), bounds.getEast(), bounds.getNorth()],
      map.getZoom(),
    );
    return marks
      .map((mark) => {
        const { x, y } = map.latLngToContainerPoint([mark.latitude, mark.longitude]);
        return { mark, x, y };
      })
      .filter(
        ({ x, y }) =>
          x > -EDGE_PX && y > -EDGE_PX && x < size.x + EDGE_PX && y < size.y + EDGE_PX,
      );
  }

  /** Names where they have room; those of selected vehicles first. */
  private drawNames(context: CanvasRenderingContext2D, colours: Colours): void {
    context.font = this.font;
    context.textAlign = "center";
    context.textBaseline = "top";
    context.lineWidth = 3;
    context.lineJoin = "round";
    context.strokeStyle = colours.halo;
    context.fillStyle = colours.ink;
    const names = this.drawn.flatMap(({ mark, x, y }) => {
      if (mark.kind !== "vehicle") return [];
      const { id } = mark.vehicle;
      return [{ id, x, y: y + LABEL_PX, width: this.widthOf(context, id) }];
    });
    const isChosen = ({ id }: { id: string }) => this.selected.has(id);
    const sorted = [...names.filter(isChosen), ...names.filter((each) => !isChosen(each))];
    for (const { id, x, y } of roomFor(sorted)) {
      context.strokeText(id, x, y);
      context.fillText(id, x, y);
    }
  }

  private widthOf(context: CanvasRenderingContext2D, id: string): number {
    const width = this.widths.get(id) ?? context.measureText(id).width;
    this.widths.set(id, width);
    return width;
  }
}
