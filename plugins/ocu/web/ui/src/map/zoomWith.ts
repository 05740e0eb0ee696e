// Canvases of the map while it zooms.
import L from "leaflet";

/** While the map zooms, a canvas of before grows or shrinks with it. */
export function zoomWith(
  map: L.Map,
  canvas: HTMLCanvasElement,
  center: L.LatLng,
  zoom: number,
): void {
  const origin = map
    .project(center, zoom)
    .subtract(map.getSize().divideBy(2))
    .add(L.DomUtil.getPosition(map.getPanes().mapPane!))
    .round();
  const corner = map.layerPointToLatLng(L.DomUtil.getPosition(canvas));
  const offset = map.project(corner, zoom).subtract(origin);
  L.DomUtil.setTransform(canvas, offset, map.getZoomScale(zoom));
}
