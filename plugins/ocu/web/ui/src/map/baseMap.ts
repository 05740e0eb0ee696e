// What every map of the page has: pictures of this machine if there are any, lines of latitude and
// longitude, a scale, and the fence of the fleet.
import L from "leaflet";
import type { Fleet } from "../shared/types";
import type { Vertex } from "./draft";
import { Graticule } from "./graticule";
import "leaflet/dist/leaflet.css";
import "./map.css";

export interface Tiles {
  max_zoom: number;
  attribution: string;
}

const FENCE = "#c2262e";
const FOR_FINGERS = 1.35;

/**
 * Leaflet keeps a request to draw that it has drawn for already: after the map is removed, it would
 * draw on a canvas that is gone.
 */
const LinesCanvas: new () => L.Canvas = L.Canvas.extend({
  _redraw(this: { _map: L.Map | null }): void {
    if (this._map) ORIGINAL._redraw.call(this);
  },
});
const ORIGINAL = L.Canvas.prototype as unknown as { _redraw(this: object): void };

export function baseMap(
  host: HTMLElement,
  fleet: Fleet,
  tiles: Tiles | null,
  options: L.MapOptions = {},
): L.Map {
  const { lat, lon } = fleet.origin;
  const map = L.map(host, {
    center: [lat, lon],
    zoom: 17,
    maxZoom: 22,
    renderer: new LinesCanvas(),
    attributionControl: tiles !== null,
    zoomSnap: 0.5,
    tapHold: true, // a long press is a right click, also where the browser makes none of it
    fadeAnimation: false, // a name that is drawn again would be there twice while one of them fades
    ...options,
  });
  map.attributionControl?.setPrefix(false);
  if (tiles) {
    L.tileLayer("/tiles/{z}/{x}/{y}.png", {
      maxNativeZoom: tiles.max_zoom,
      maxZoom: 22,
      attribution: escaped(tiles.attribution),
    }).addTo(map);
  }
  L.control.scale({ imperial: false }).addTo(map);
  new Graticule(map);
  if (fleet.fence) {
    const style = { color: FENCE, weight: 2, dashArray: "6 6", fill: false, interactive: false };
    L.geoJSON(fleet.fence, { style }).addTo(map);
  }
  return map;
}

/** Leaflet takes it as HTML. */
export const escaped = (text: string): string =>
  text
    .replaceAll("&", "&amp;")
    .replaceAll("<", "&lt;")
    .replaceAll(">", "&gt;")
    .replaceAll('"', "&quot;");

/** How large something is drawn that is dragged: larger for a finger. */
export const handlePx = (px: number): number =>
  matchMedia("(pointer: coarse)").matches ? Math.round(px * FOR_FINGERS) : px;

export const vertexOf = ({ lat, lng }: L.LatLng): Vertex => ({
  latitude: lat,
  longitude: lng,
  altitude: null,
});

export const placeOf = ({ latitude, longitude }: Vertex): L.LatLngTuple => [latitude, longitude];
