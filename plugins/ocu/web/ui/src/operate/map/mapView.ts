// The map, without Preact: Leaflet with no tiles but local ones.
import L from "leaflet";
import type { Fleet, Geometry, SharedSpace } from "../../shared/types";
import type { Draft, Vertex } from "../../map/draft";
import { baseMap, escaped, handlePx, placeOf, vertexOf, type Tiles } from "../../map/baseMap";
import { markCrowded } from "../../map/labels";
import { fill, strings } from "../../strings";
import { DetectionLayer } from "./detectionLayer";
import { VehicleLayer } from "./vehicleLayer";

const text = strings.operate.map;

export interface MapListener {
  chosen(resource: string): void;
  /** A detection was chosen. */
  detected(number: number): void;
  clicked(vertex: Vertex): void;
  dragged(index: number, to: Vertex): void;
  /** A hand moved the map: it follows no vehicle any more. */
  moved(): void;
}

const OF_FLEET = "#56687a";
const OF_OPERATOR = "#8347c7";
const OF_MISSION = "#0b63ce";
/** Below the vehicles: their names are read on top of others. */
const NAMES_PANE = "shadowPane";
/** From how large on a geometry's name is shown. */
const NAMED_PX = 120;
const NAMED_ZOOM = 17;
const FREE = "#1f7a3d";
const FULL = "#b35c00";
const EQUATOR_M = 40_075_017;
const TILE_PX = 256;
/** A label of a space stands so far above its middle: names of routes are there. */
const LABEL_PX = 14;
const DRAFT = "#0b63ce";
const VERTEX_PX = 22;

export class MapView {
  readonly vehicles: VehicleLayer;
  readonly detections: DetectionLayer;
  private readonly map: L.Map;
  private readonly geometries = L.layerGroup();
  private readonly spaces = L.layerGroup();
  private readonly drafted = L.layerGroup();
  private readonly compared = L.layerGroup();
  private readonly observer: ResizeObserver;
  private readonly corridors = new WeakMap<L.Layer, number | null>();
  private isDrawing = false;

  constructor(
    host: HTMLElement,
    private readonly fleet: Fleet,
    tiles: Tiles | null,
    private readonly listener: MapListener,
  ) {
    this.map = baseMap(host, fleet, tiles);
    this.spaces.addTo(this.map);
    this.geometries.addTo(this.map);
    this.map.on("zoomend", () => {
      this.nameGeometries();
      this.widenCorridors();
    });
    this.drafted.addTo(this.map);
    this.compared.addTo(this.map);
    this.vehicles = new VehicleLayer(this.map, fleet);
    this.detections = new DetectionLayer(this.map, (number) => listener.detected(number));
    this.map.on("click", ({ latlng, containerPoint }) => {
      if (this.isDrawing) return listener.clicked(vertexOf(latlng));
      const resource = this.vehicles.at(containerPoint);
      if (resource) listener.chosen(resource);
    });
    this.map.on("dragstart", () => listener.moved());
    // What is drawn stays under the pointer, whatever room the form beside the map takes.
    this.observer = new ResizeObserver(() =>
      this.map.invalidateSize({ animate: false, pan: !this.isDrawing }),
    );
    this.observer.observe(host);
  }

  dispose(): void {
    this.observer.disconnect();
    this.vehicles.dispose();
    this.map.remove();
  }

  showGeometries(geometries: readonly Geometry[]): void {
    this.geometries.clearLayers();
    for (const geometry of geometries) {
      layerOf(geometry)
        .bindTooltip(escaped(geometry.name), {
          permanent: true,
          direction: "center",
          className: "map-name",
          pane: NAMES_PANE,
        })
        .addTo(this.geometries);
    }
    this.nameGeometries();
  }

  /** Full ones stand out; each has who is in it, and how many wait, beside its name. */
  showSpaces(spaces: readonly SharedSpace[]): void {
    this.spaces.clearLayers();
    for (const space of spaces) {
      const { name, capacity, holders, waiting, geometry, width_m } = space;
      const color = holders.length >= capacity ? FULL : FREE;
      const style = { color, weight: 2, fillOpacity: 0.18, interactive: false };
      const corridor = { ...style, opacity: 0.35, lineCap: "butt" as const };
      const layer = L.geoJSON(geometry, { style: width_m === null ? style : corridor });
      this.corridors.set(layer, width_m);
      const label = [
        fill(text.space, { name, taken: holders.length, capacity }),
        holders.map(({ vehicle }) => vehicle).join(", "),
        waiting.length > 0 ? fill(text.spaceWaiting, { count: waiting.length }) : "",
      ];
      layer
        .bindTooltip(escaped(label.filter(Boolean).join(" · ")), {
          permanent: true,
          direction: "top",
          offset: [0, -LABEL_PX],
          className: "map-name map-space",
          pane: NAMES_PANE,
        })
        .addTo(this.spaces);
    }
    this.widenCorridors();
    this.nameGeometries();
  }

  /** A corridor is as wide on the map as it is on the ground. */
  private widenCorridors(): void {
    const [at, zoom] = [this.map.getCenter(), this.map.getZoom()];
    const metres_per_px =
      (Math.cos((at.lat * Math.PI) / 180) * EQUATOR_M) / (TILE_PX * 2 ** zoom);
    this.spaces.eachLayer((layer) => {
      const width_m = this.corridors.get(layer) ?? null;
      if (width_m !== null && layer instanceof L.GeoJSON) {
        layer.setStyle({ weight: Math.max(2, width_m / metres_per_px) });
      }
    });
  }

  /** Names of what is small are left out, and those that would lie on one of something larger. */
  private nameGeometries(): void {
    const named: { element: HTMLElement; size: number }[] = [];
    this.spaces.eachLayer((layer) => {
      const element = layer.getTooltip()?.getElement();
      if (element) named.push({ element, size: Infinity });
    });
    this.geometries.eachLayer((layer) => {
      const element = layer.getTooltip()?.getElement();
      if (!element || !(layer instanceof L.GeoJSON)) return;
      const bounds = layer.getBounds();
      const from = this.map.latLngToLayerPoint(bounds.getNorthWest());
      const size = from.distanceTo(this.map.latLngToLayerPoint(bounds.getSouthEast()));
      const isPoint = bounds.getNorthWest().equals(bounds.getSouthEast());
      const isLarge = isPoint ? this.map.getZoom() >= NAMED_ZOOM : size >= NAMED_PX;
      element.classList.toggle("map-unnamed", !isLarge);
      if (isLarge) named.push({ element, size });
    });
    named.sort((one, other) => other.size - one.size);
    const labels = named.map(({ element, size }) => ({ element, stays: size === Infinity }));
    markCrowded(labels, "map-unnamed");
  }

  /** A former version beside what is there now, which stays as it is. */
  compare(geometry: GeoJSON.Geometry | null): void {
    this.compared.clearLayers();
    if (!geometry) return;
    const style = { color: DRAFT, weight: 4, dashArray: "2 8", fill: false, interactive: false };
    const layer = L.geoJSON(geometry, {
      style,
      pointToLayer: (_, at) => L.circleMarker(at, { ...style, radius: 10 }),
    });
    layer.addTo(this.compared);
    const bounds = layer.getBounds();
    if (bounds.isValid() && !this.map.getBounds().contains(bounds)) {
      this.map.fitBounds(bounds.extend(this.map.getBounds()), { animate: false });
    }
  }

  turnGeometries(on: boolean): void {
    if (on) this.geometries.addTo(this.map);
    else this.geometries.remove();
    this.nameGeometries();
  }

  /** `withDetections`: if an operator asks for it, as devices may report places far away. */
  fitAll(withDetections = false): void {
    const bounds = L.latLngBounds(this.vehicles.positions());
    if (withDetections) this.detections.positions().forEach((each) => bounds.extend(each));
    this.geometries.eachLayer((layer) => {
      if (layer instanceof L.GeoJSON) bounds.extend(layer.getBounds());
    });
    if (!bounds.isValid()) bounds.extend([this.fleet.origin.lat, this.fleet.origin.lon]);
    this.map.fitBounds(bounds, { padding: [36, 36], maxZoom: 18, animate: false });
  }

  centre(resource: string): void {
    const at = this.vehicles.position(resource);
    if (at) this.map.setView(at, Math.max(this.map.getZoom(), 17), { animate: true });
  }

  /** Keep a vehicle in the middle, without a jump at each step. */
  follow(resource: string): void {
    const at = this.vehicles.position(resource);
    if (!at) return;
    const off = this.map.latLngToContainerPoint(at).distanceTo(this.map.getSize().divideBy(2));
    if (off > 4) this.map.panTo(at, { animate: false, noMoveStart: true });
  }

  middle(): Vertex {
    return vertexOf(this.map.getCenter());
  }

  draw(draft: Draft | null): void {
    this.isDrawing = draft !== null;
    this.map.getContainer().classList.toggle("map-drawing", this.isDrawing);
    this.drafted.clearLayers();
    if (!draft) return;
    const points = draft.vertices.map(placeOf);
    const style = { color: DRAFT, weight: 3, dashArray: "4 6", interactive: false };
    const line = draft.kind === "area" ? L.polygon(points, style) : L.polyline(points, style);
    if (draft.kind !== "point") line.addTo(this.drafted);
    points.forEach((point, index) => this.handle(point, index, line));
  }

  private handle(point: L.LatLngTuple, index: number, line: L.Polyline | L.Polygon): void {
    const icon = L.divIcon({
      className: "map-vertex",
      html: String(index + 1),
      iconSize: [handlePx(VERTEX_PX), handlePx(VERTEX_PX)],
    });
    const marker = L.marker(point, { icon, draggable: true, keyboard: false, zIndexOffset: 2000 });
    marker.on("drag", () => {
      const points = (
        line instanceof L.Polygon ? line.getLatLngs()[0] : line.getLatLngs()
      ) as L.LatLng[];
      line.setLatLngs(points.map((other, at) => (at === index ? marker.getLatLng() : other)));
    });
    marker.on("dragend", () => this.listener.dragged(index, vertexOf(marker.getLatLng())));
    marker.addTo(this.drafted);
  }
}

function layerOf({ kind, from, geometry }: Geometry): L.GeoJSON {
  const color = { fleet: OF_FLEET, operator: OF_OPERATOR, mission: OF_MISSION }[from];
  const style: L.PathOptions = {
    color,
    weight: kind === "route" ? 3 : 2,
    fillOpacity: kind === "area" ? 0.1 : 0.9,
    interactive: false,
    ...(kind === "route" ? { dashArray: "10 5" } : {}),
  };
  return L.geoJSON(geometry, {
    style,
    pointToLayer: (_, at) => L.circleMarker(at, { ...style, radius: 7 }),
  });
}
