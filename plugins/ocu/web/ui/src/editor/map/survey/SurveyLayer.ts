// A survey on the map while its form is open: the routes, each in the colour of its vehicle, and a
// handle that turns the passes.
import L from "leaflet";
import { handlePx, placeOf, vertexOf } from "../../../map/baseMap";
import type { Vertex } from "../../../map/draft";
import { strings } from "../../../strings";
import type { SurveyRoutes } from "./pattern";

const RADIUS_PX = 90;
const HANDLE_PX = 30;
const DENSE_PX = 7;
/** Of latitude. */
const METRES_IN_DEGREE = 111_195;
const RAD = Math.PI / 180;

export interface ShownSurvey {
  routes: SurveyRoutes | null;
  /** Of the passes, from north, clockwise. */
  heading_deg: number;
  middle: Vertex;
}

export class SurveyLayer {
  private readonly lines = L.layerGroup();
  private readonly handles = L.layerGroup();
  /** Above the map's canvas, which is not drawn again for each step of a slider. */
  private readonly renderer = L.svg();
  private shown: ShownSurvey | null = null;
  private isTurning = false;
  private turn: (heading_deg: number) => void = () => undefined;

  constructor(
    private readonly map: L.Map,
    private readonly colour: (who: string) => string,
  ) {
    this.lines.addTo(map);
    this.handles.addTo(map);
    map.on("zoomend", () => this.show(this.shown, this.turn));
  }

  /** Null: there is none. `turn`: the passes are turned by the handle. */
  show(survey: ShownSurvey | null, turn: (heading_deg: number) => void): void {
    this.shown = survey;
    this.turn = turn;
    this.lines.clearLayers();
    const isDense = survey?.routes ? this.pixels(survey.middle, survey.routes.spacing_m) < DENSE_PX : false;
    for (const { vehicle, geojson } of survey?.routes?.routes ?? []) {
      const color = this.colour(vehicle);
      const places = geojson.geometry.coordinates.map(
        ([longitude = 0, latitude = 0]): [number, number] => [latitude, longitude],
      );
      const style = { renderer: this.renderer, interactive: false, className: "survey-line" };
      // Where passes lie close, the ground shows between them.
      const halo = { ...style, color: "#ffffff", weight: 5, opacity: 0.85 };
      if (!isDense) L.polyline(places, halo).addTo(this.lines);
      L.polyline(places, { ...style, color, weight: isDense ? 1 : 2.5 }).addTo(this.lines);
      const end = { ...style, radius: 6, color: "#ffffff", weight: 2, fillColor: color, fillOpacity: 1 };
      if (places[0]) L.circleMarker(places[0], end).addTo(this.lines);
      if (places.length > 1) L.circleMarker(places.at(-1)!, { ...end, radius: 4 }).addTo(this.lines);
    }
    if (!this.isTurning) this.handle();
  }

  /** How far apart places of that distance are on the screen. */
  private pixels(at: Vertex, length_m: number): number {
    const north = { ...at, latitude: at.latitude + length_m / METRES_IN_DEGREE };
    const [one, other] = [at, north].map((each) => this.map.latLngToContainerPoint(placeOf(each)));
    return one!.distanceTo(other!);
  }

  private handle(): void {
    this.handles.clearLayers();
    const { shown } = this;
    if (!shown) return;
    const middle = this.map.latLngToContainerPoint(placeOf(shown.middle));
    const end = this.endOf(middle, shown.heading_deg);
    const line = L.polyline(
      [placeOf(shown.middle), this.map.containerPointToLatLng(end)],
      { color: "#17212b", weight: 2, dashArray: "4 4", interactive: false },
    ).addTo(this.handles);
    const icon = L.divIcon({
      className: "survey-turn",
      html: `<b>${Math.round(shown.heading_deg)}°</b>`,
      iconSize: [handlePx(HANDLE_PX), handlePx(HANDLE_PX)],
    });
    const at = this.map.containerPointToLatLng(end);
    const marker = L.marker(at, { icon, draggable: true, keyboard: false, zIndexOffset: 3000 });
    marker.on("dragstart", () => (this.isTurning = true));
    marker.on("drag", () => {
      const to = this.map.latLngToContainerPoint(marker.getLatLng());
      const heading = this.headingOf(to.x - middle.x, to.y - middle.y);
      line.setLatLngs([placeOf(shown.middle), marker.getLatLng()]);
      marker.getElement()!.firstElementChild!.textContent = `${heading}°`;
      this.turn(heading);
    });
    marker.on("dragend", () => {
      this.isTurning = false;
      this.handle();
    });
    marker.bindTooltip(strings.survey.turnHandle, { direction: "top", offset: [0, -14] });
    marker.addTo(this.handles);
  }

  private endOf({ x, y }: L.Point, heading_deg: number): L.Point {
    const angle = heading_deg * RAD;
    return L.point(x + RADIUS_PX * Math.sin(angle), y - RADIUS_PX * Math.cos(angle));
  }

  private headingOf(right: number, down: number): number {
    const degrees = Math.round(Math.atan2(right, -down) / RAD);
    return (degrees + 360) % 360;
  }
}

/** Where its handle turns. */
export const middleOfArea = (vertices: readonly Vertex[]): Vertex => {
  const bounds = L.latLngBounds(vertices.map(placeOf));
  return vertexOf(bounds.getCenter());
};
