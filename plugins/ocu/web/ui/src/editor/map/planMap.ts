// The editor's map, without Preact: geometries that can be selected, handles to change one, and what
// the mission commands, numbered.
import L from "leaflet";
import { baseMap, escaped, handlePx, placeOf, vertexOf, type Tiles } from "../../map/baseMap";
import {
  draftOf,
  inserted,
  LEAST,
  moved,
  removed,
  shifted,
  type Draft,
  type Vertex,
} from "../../map/draft";
import { markCrowded } from "../../map/labels";
import { distance_m, legs_m, middleOf, writtenLength } from "../../map/measure";
import { snapped } from "../../map/snap";
import { VehicleLayer } from "../../operate/map/vehicleLayer";
import type { Finding, Fleet, Geometry } from "../../shared/types";
import { strings } from "../../strings";
import { colourOf } from "./colours";
import type { MapCommand } from "./commands";
import { SurveyLayer } from "./survey/SurveyLayer";

const words = strings.plan;

export interface PlanListener {
  /** A geometry was clicked, "" beside all of them. */
  chosen(name: string): void;
  commandChosen(task: string): void;
  /** A place was clicked, while something is drawn or a place is picked. */
  clicked(at: Vertex): void;
  /** What is drawn is complete. */
  finished(): void;
  /** The selected geometry has another shape. */
  edited(draft: Draft): void;
}

export interface Shown {
  geometries: readonly Geometry[];
  commands: readonly MapCommand[];
  /** The geometry that is selected. */
  selected: string;
  /** Tasks that are selected on the diagram. */
  tasks: readonly string[];
  colour(who: string): string;
}

const OF_FLEET = "#56687a";
const OF_OPERATOR = "#8347c7";
const OF_MISSION = "#0b63ce";
const DRAFT = "#0b63ce";
/** From how large on a geometry's name is shown: one that the mission does not use says little. */
const NAMED_PX = 60;
const NAMED_UNUSED_PX = 220;
const NEAR_PX = 4;
/** Between a badge and the edge of the map. */
const EDGE_PX = 6;

export class PlanMap {
  /** Of a rehearsal that is played. */
  readonly vehicles: VehicleLayer;
  /** Whose form is open. */
  readonly survey: SurveyLayer;
  private readonly map: L.Map;
  private readonly geometries = L.featureGroup();
  private readonly badges = L.layerGroup();
  private readonly handles = L.layerGroup();
  private readonly preview = L.featureGroup();
  private readonly found = L.featureGroup();
  private readonly band: L.Polyline;
  private readonly observer: ResizeObserver;
  private draft: Draft | null = null;
  private isNew = false;
  private picksPlace = false;
  private corners: Vertex[] = [];
  /** What the geometry that is selected covers; null: none is. */
  private selected: L.LatLngBounds | null = null;
  private readonly named_px = new WeakMap<L.Layer, number>();

  constructor(
    host: HTMLElement,
    private readonly fleet: Fleet,
    tiles: Tiles | null,
    private readonly listener: PlanListener,
  ) {
    this.map = baseMap(host, fleet, tiles);
    this.map.doubleClickZoom.disable(); // two clicks end a drawing
    for (const layer of [this.geometries, this.preview, this.badges, this.handles, this.found]) {
      layer.addTo(this.map);
    }
    this.vehicles = new VehicleLayer(this.map, fleet);
    this.survey = new SurveyLayer(this.map, (who) => colourOf(fleet.vehicles, who));
    const style = { color: DRAFT, weight: 2, dashArray: "2 6", interactive: false };
    this.band = L.polyline([], style).addTo(this.map);
    this.map.on("click", ({ latlng }) => this.click(latlng));
    this.map.on("mousemove", ({ latlng }) => this.stretch(latlng));
    this.map.on("moveend", () => this.placeLabels()); // also after the zoom has changed
    this.observer = new ResizeObserver(() => {
      const had = this.map.getSize();
      const wasSeen = this.isSeen(this.selected);
      // What is drawn stays under the pointer, whatever room the form below takes.
      this.map.invalidateSize({ animate: false, pan: !this.isNew });
      if (had.x === 0) this.fit();
      else if (wasSeen && !this.isSeen(this.selected)) this.fitTo(this.selected!);
    });
    this.observer.observe(host);
  }

  dispose(): void {
    this.observer.disconnect();
    this.vehicles.dispose();
    this.map.remove();
  }

  show({ geometries, commands, selected, tasks, colour }: Shown): void {
    this.geometries.clearLayers();
    this.badges.clearLayers();
    const places = new Map<string, MapCommand[]>();
    for (const each of commands) {
      const at = each.at ?? this.placeOf(geometries.find(({ name }) => name === each.geometry));
      if (!at) continue;
      const key = placeOf(at).join();
      places.set(key, [...(places.get(key) ?? []), { ...each, at }]);
    }
    for (const geometry of geometries) {
      const users = commands.filter((each) => each.geometry === geometry.name);
      const isOn = users.some(({ task }) => tasks.includes(task));
      const used = users[0] ? colour(users[0].who) : null;
      this.geometry(geometry, used, isOn || geometry.name === selected);
    }
    for (const there of places.values()) this.badge(there, tasks, colour);
    const looked = geometries.find(({ name }) => name === selected);
    this.selected = looked ? L.geoJSON(looked.geometry).getBounds() : null;
    this.corners = geometries
      .filter(({ name }) => name !== selected)
      .flatMap((each) => [...draftOf(each).vertices]);
    this.placeLabels();
  }

  /** Handles at the vertices of what is changed, or drawn; null: of nothing. */
  edit(draft: Draft | null, isNew: boolean): void {
    this.draft = draft;
    this.isNew = isNew && draft !== null;
    this.crosshair();
    this.band.setLatLngs([]).unbindTooltip();
    this.handles.clearLayers();
    if (draft) this.addHandles(draft);
    this.placeLabels();
  }

  private addHandles(draft: Draft): void {
    const { isNew } = this;
    const points = draft.vertices.map(placeOf);
    const style = { color: DRAFT, weight: 3, interactive: false, ...(isNew && { dashArray: "4 6" }) };
    const line = draft.kind === "area" ? L.polygon(points, style) : L.polyline(points, style);
    if (draft.kind !== "point") line.addTo(this.handles);
    this.legs(draft);
    draft.vertices.forEach((vertex, index) => this.vertex(vertex, index, draft, line));
    if (!isNew && draft.kind !== "point") this.mover(draft, line);
  }

  /** Clicks anywhere mean a place. */
  pickPlace(picks: boolean): void {
    this.picksPlace = picks;
    this.crosshair();
  }

  /** Drawings of a file, before they are taken. */
  propose(features: readonly GeoJSON.Feature[]): void {
    this.preview.clearLayers();
    const style = { color: "#8347c7", weight: 3, dashArray: "3 6", interactive: false };
    for (const each of features) {
      L.geoJSON(each, {
        style,
        pointToLayer: (_, at) => L.circleMarker(at, { ...style, radius: 8 }),
      }).addTo(this.preview);
    }
    if (features.length > 0) this.fitTo(this.preview.getBounds());
  }

  /** Marks where something is wrong, and brings that into view. */
  mark(findings: readonly Finding[]): void {
    this.found.clearLayers();
    for (const { place, message } of findings) {
      const style = { className: "plan-finding", color: "#c62828", radius: 9, weight: 3 };
      if (place) L.circleMarker(place, style).bindTooltip(message).addTo(this.found);
    }
    const bounds = this.found.getBounds();
    if (bounds.isValid() && !this.isSeen(bounds)) this.fitTo(bounds);
  }

  fit(): void {
    const bounds = this.geometries.getBounds().extend(this.preview.getBounds());
    const { lat, lon } = this.fleet.origin;
    if (!bounds.isValid()) bounds.extend([lat, lon]);
    this.fitTo(bounds);
  }

  /** Brings a geometry into view, unless it is there. */
  look(geometry: Geometry): void {
    const bounds = L.geoJSON(geometry.geometry).getBounds();
    if (bounds.isValid() && !this.isSeen(bounds)) this.fitTo(bounds);
  }

  private isSeen(bounds: L.LatLngBounds | null): boolean {
    return bounds !== null && this.map.getBounds().contains(bounds);
  }

  middle(): Vertex {
    return vertexOf(this.map.getCenter());
  }

  private fitTo(bounds: L.LatLngBounds): void {
    if (!bounds.isValid() || this.map.getSize().x === 0) return;
    this.map.fitBounds(bounds, { padding: [48, 48], maxZoom: 18, animate: false });
  }

  private crosshair(): void {
    const draws = this.isNew || this.picksPlace;
    this.map.getContainer().classList.toggle("map-drawing", draws);
  }

  private click(latlng: L.LatLng): void {
    if (!this.isNew && !this.picksPlace) return this.listener.chosen("");
    const last = this.draft?.vertices.at(-1);
    // The second click of two in one place ends the drawing.
    if (last && this.draft?.kind !== "point" && this.pixels(last, vertexOf(latlng)) < NEAR_PX) return;
    this.listener.clicked(this.snap(vertexOf(latlng)));
  }

  private pixels(one: Vertex, other: Vertex): number {
    const [a, b] = [one, other].map((each) => this.map.latLngToContainerPoint(placeOf(each)));
    return a!.distanceTo(b!);
  }

  private snap(vertex: Vertex): Vertex {
    return snapped(vertex, this.corners, (each) => this.map.latLngToContainerPoint(placeOf(each)));
  }

  /** From the last vertex to the pointer, with how far that is. */
  private stretch(latlng: L.LatLng): void {
    const last = this.isNew && this.draft?.kind !== "point" && this.draft?.vertices.at(-1);
    if (!last) return;
    this.band.setLatLngs([placeOf(last), latlng]);
    const length = writtenLength(distance_m(last, vertexOf(latlng)));
    if (this.band.getTooltip()) this.band.setTooltipContent(length);
    else this.band.bindTooltip(length, { permanent: true, className: "plan-length" });
  }

  private geometry(geometry: Geometry, used: string | null, isOn: boolean): void {
    const from = { fleet: OF_FLEET, operator: OF_OPERATOR, mission: OF_MISSION }[geometry.from];
    const { kind, name } = geometry;
    const style: L.PathOptions = {
      color: used ?? from,
      weight: isOn ? 6 : kind === "route" ? 4 : 2.5,
      opacity: isOn || used || geometry.from === "mission" ? 1 : 0.6,
      fillOpacity: kind === "area" ? (isOn ? 0.25 : 0.1) : 0.9,
      ...(!used && kind !== "point" ? { dashArray: "10 5" } : {}),
    };
    const layer = L.geoJSON(geometry.geometry, {
      style,
      pointToLayer: (_, at) => L.circleMarker(at, { ...style, radius: isOn ? 10 : 8 }),
    });
    const isOurs = isOn || used !== null || geometry.from === "mission";
    this.named_px.set(layer, isOurs ? NAMED_PX : NAMED_UNUSED_PX);
    layer
      .bindTooltip(escaped(name), { permanent: true, direction: "center", className: "map-name" })
      .on("click", (event: L.LeafletMouseEvent) => {
        if (this.isNew) return; // the map takes it: a new vertex may lie on another geometry
        L.DomEvent.stopPropagation(event);
        this.listener.chosen(name);
      })
      .addTo(this.geometries);
  }

  /** Where a command is seen: the beginning of a route, the middle of an area. */
  private placeOf(geometry: Geometry | undefined): Vertex | undefined {
    if (!geometry) return undefined;
    const { kind, vertices } = draftOf(geometry);
    const [first] = vertices;
    return kind === "area" && first ? { ...middleOf(vertices), altitude: null } : first;
  }

  private badge(there: readonly MapCommand[], tasks: readonly string[], colour: Shown["colour"]): void {
    const rows = there.map(({ task, number, title, who }) => {
      const on = tasks.includes(task) ? " plan-badge-on" : "";
      return (
        `<button type="button" tabindex="-1" data-task="${escaped(task)}" class="plan-badge${on}" ` +
        `title="${escaped(title)}"><b style="background:${colour(who)}">${number}</b><span>${escaped(title)}</span></button>`
      );
    });
    const icon = L.divIcon({ className: "plan-badges", html: rows.join(""), iconSize: undefined });
    const marker = L.marker(placeOf(there[0]!.at!), { icon, keyboard: false, zIndexOffset: 500 });
    marker.on("click", ({ originalEvent }) => {
      const row = (originalEvent.target as HTMLElement).closest<HTMLElement>("[data-task]");
      if (row?.dataset.task) this.listener.commandChosen(row.dataset.task);
    });
    marker.addTo(this.badges);
  }

  private vertex(vertex: Vertex, index: number, draft: Draft, line: L.Polyline | L.Polygon): void {
    const marker = this.handle(vertex, "map-vertex", String(index + 1), 22, 2000);
    let to = vertex;
    marker.on("drag", () => {
      to = { ...this.snap(vertexOf(marker.getLatLng())), altitude: vertex.altitude };
      const all = draft.vertices.map((other, at) => placeOf(at === index ? to : other));
      line.setLatLngs(all);
    });
    marker.on("dragend", () => {
      const { latitude, longitude } = to;
      this.listener.edited(moved(draft, index, { latitude, longitude }));
    });
    marker.on("click", () => {
      const isEnd = index === 0 || index === draft.vertices.length - 1;
      if (this.isNew && isEnd && draft.vertices.length >= LEAST[draft.kind]) {
        this.listener.finished();
      }
    });
    marker.on("contextmenu", ({ originalEvent }) => {
      if (draft.vertices.length <= LEAST[draft.kind]) return;
      const remove = () => this.listener.edited(removed(draft, index));
      // Leaflet's long press ends where the finger is lifted, which must still be on the page then.
      if ("_simulated" in originalEvent) addEventListener("touchend", remove, { once: true });
      else remove();
    });
    const hint = draft.kind === "point" ? words.dragPoint : words.dragVertex;
    if (!this.isNew) marker.bindTooltip(hint, { direction: "top", offset: [0, -12] });
  }

  /** How long each leg is; dragged, that makes a vertex there. */
  private legs(draft: Draft): void {
    const { kind, vertices } = draft;
    const closed = kind === "area" && !this.isNew;
    if (kind === "point") return;
    legs_m(vertices, closed).forEach((length, index) => {
      const ends = [vertices[index]!, vertices[(index + 1) % vertices.length]!];
      const middle: Vertex = { ...middleOf(ends), altitude: null };
      const marker = this.handle(middle, "plan-leg", `<i></i><span>${writtenLength(length)}</span>`, 14, 1500);
      const insert = (at: Vertex) => this.listener.edited(inserted(draft, index + 1, at));
      marker.on("dragend", () => insert(this.snap(vertexOf(marker.getLatLng()))));
      marker.on("click", () => insert(middle));
    });
  }

  private mover(draft: Draft, line: L.Polyline | L.Polygon): void {
    const middle: Vertex = { ...middleOf(draft.vertices), altitude: null };
    const at = draft.kind === "area" ? middle : draft.vertices[0]!;
    const marker = this.handle(at, "plan-mover", "✥", 24, 1800, draft.kind === "area" ? 0 : 22);
    const by = (): [number, number] => {
      const { lat, lng } = marker.getLatLng();
      return [lat - at.latitude, lng - at.longitude];
    };
    marker.on("drag", () => line.setLatLngs(shifted(draft, ...by()).vertices.map(placeOf)));
    marker.on("dragend", () => this.listener.edited(shifted(draft, ...by())));
    marker.bindTooltip(words.dragAll, { direction: "top", offset: [0, -12] });
  }

  private handle(
    at: Vertex,
    className: string,
    html: string,
    usual_px: number,
    zIndexOffset: number,
    aside_px = 0,
  ): L.Marker {
    const size = handlePx(usual_px);
    const iconAnchor: L.PointTuple = [size / 2 + aside_px, size / 2 + aside_px];
    const icon = L.divIcon({ className, html, iconSize: [size, size], iconAnchor });
    const options = { icon, draggable: true, keyboard: false, zIndexOffset };
    return L.marker(placeOf(at), options).addTo(this.handles);
  }

  /**
   * Badges keep their numbers, and their titles where there is room. Names of what is small are left
   * out, and those that would lie on a badge, a handle or another name.
   */
  private placeLabels(): void {
    const all = (selector: string) => [
      ...this.map.getContainer().querySelectorAll<HTMLElement>(selector),
    ];
    const boxOf = (element: HTMLElement) => element.getBoundingClientRect();
    const handles = all(".map-vertex, .plan-leg span, .plan-mover").map(boxOf);
    const badges = [...all(".plan-badge-on"), ...all(".plan-badge:not(.plan-badge-on)")];
    pullIn(badges, boxOf(this.map.getContainer()));
    markCrowded(
      badges.map((element) => ({ element })),
      "plan-badge-short",
      handles,
    );
    const named: { element: HTMLElement; size: number }[] = [];
    this.geometries.eachLayer((layer) => {
      const element = layer.getTooltip()?.getElement();
      if (!element || !(layer instanceof L.GeoJSON)) return;
      const bounds = layer.getBounds();
      const [one, other] = [bounds.getNorthWest(), bounds.getSouthEast()];
      const size = this.map.latLngToLayerPoint(one).distanceTo(this.map.latLngToLayerPoint(other));
      const isLarge = one.equals(other) || size >= (this.named_px.get(layer) ?? NAMED_PX);
      element.classList.toggle("map-unnamed", !isLarge);
      if (isLarge) named.push({ element, size });
    });
    named.sort((one, other) => other.size - one.size);
    markCrowded(named, "map-unnamed", [...handles, ...badges.map(boxOf)]);
  }
}

/** Badges that would end beyond the right edge of the map go to the left. */
function pullIn(badges: readonly HTMLElement[], map: DOMRect): void {
  for (const badge of badges) {
    badge.classList.remove("plan-badge-short");
    badge.style.translate = "";
  }
  const boxes = badges.map((badge) => badge.getBoundingClientRect());
  badges.forEach((badge, index) => {
    const { left, right } = boxes[index]!;
    const beyond = right + EDGE_PX - map.right;
    if (beyond > 0 && left < map.right) badge.style.translate = `${-beyond}px`;
  });
}
