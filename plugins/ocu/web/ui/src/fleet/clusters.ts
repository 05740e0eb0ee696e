// Vehicles that are near each other on the map, drawn as one.
import Supercluster from "supercluster";
import type { Counted } from "../map/vehicleSymbols";
import type { Health } from "../map/health";
import type { Mark } from "../map/vehicleCanvas";
import type { Row } from "./rows";

/** Smaller fleets are seen one by one: a formation is not drawn as a number. */
const LEAST = 50;
const RADIUS_PX = 44;
const TILE_PX = 256;
/** From this zoom on each vehicle is drawn. */
export const WHOLE_ZOOM = 18;

export class Clusters {
  private readonly index = new Supercluster<{ row: Row }, { healths: Counted }>({
    radius: RADIUS_PX,
    extent: TILE_PX,
    maxZoom: WHOLE_ZOOM - 1,
    map: ({ row }) => ({ healths: { [row.health]: 1 } }),
    reduce: (all, { healths }) => {
      // The first one is that of a vehicle, or of a cluster within: it is not changed.
      all.healths = { ...all.healths };
      for (const [health, count] of Object.entries(healths)) {
        all.healths[health as Health] = (all.healths[health as Health] ?? 0) + count;
      }
    },
  });
  private rows: readonly Row[] = [];
  private areClustered = false;

  load(rows: readonly Row[]): void {
    this.rows = rows.filter(({ latitude, longitude }) => latitude !== null && longitude !== null);
    this.areClustered = this.rows.length >= LEAST;
    if (!this.areClustered) return;
    this.index.load(
      this.rows.map((row) => ({
        type: "Feature",
        properties: { row },
        geometry: { type: "Point", coordinates: [row.longitude!, row.latitude!] },
      })),
    );
  }

  get known(): readonly Row[] {
    return this.rows;
  }

  /** What is drawn within bounds, degrees: west, south, east, north. */
  marks(bounds: [number, number, number, number], zoom: number): Mark[] {
    if (!this.areClustered) return this.rows.map(markOf);
    return this.index.getClusters(bounds, Math.floor(zoom)).map((found): Mark => {
      const [longitude = 0, latitude = 0] = found.geometry.coordinates;
      const { properties } = found;
      return "cluster_id" in properties
        ? {
            kind: "cluster",
            id: properties.cluster_id,
            count: properties.point_count,
            healths: properties.healths,
            latitude,
            longitude,
          }
        : markOf(properties.row);
    });
  }

  /** The zoom at which a cluster comes apart. */
  zoomOf(cluster: number): number {
    return this.index.getClusterExpansionZoom(cluster);
  }
}

const markOf = (row: Row): Mark => ({
  kind: "vehicle",
  vehicle: row,
  latitude: row.latitude!,
  longitude: row.longitude!,
});
