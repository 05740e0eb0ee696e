// The vehicles of the fleet on the map: many that are near each other as one, and lines to where
// they would go.
import L from "leaflet";
import { VehicleCanvas } from "../map/vehicleCanvas";
import type { Colours } from "../map/vehicleSymbols";
import { Clusters } from "./clusters";
import type { Row } from "./rows";

export class FleetLayer {
  private readonly clusters = new Clusters();
  private readonly canvas: VehicleCanvas;
  private destination: [number, number] | null = null;
  private going: readonly string[] = [];

  constructor(map: L.Map) {
    this.canvas = new VehicleCanvas({
      marks: (bounds, zoom) => this.clusters.marks(bounds, zoom),
      under: (context, colours) => this.drawAim(context, map, colours),
    }).addTo(map);
  }

  load(rows: readonly Row[]): void {
    this.clusters.load(rows);
    this.canvas.redraw();
  }

  choose(selected: ReadonlySet<string>): void {
    this.canvas.choose(selected);
  }

  /** Lines from vehicles to where they would go. */
  aim(destination: [number, number] | null, going: readonly string[]): void {
    this.destination = destination;
    this.going = going;
    this.canvas.redraw();
  }

  at(point: L.Point) {
    return this.canvas.at(point);
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
