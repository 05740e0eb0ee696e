// The routes, areas and points of two versions on one map: dashed before, solid after.
import L from "leaflet";
import { useEffect, useRef } from "preact/hooks";
import { baseMap, placeOf } from "../map/baseMap";
import { draftOf } from "../map/draft";
import type { Fleet, Geometry } from "../shared/types";
import { strings } from "../strings";
import type { GeometryChange } from "./geometryChanges";

const words = strings.compare;

const BEFORE = "#b3541e";
const AFTER = "#0b63ce";
const SAME = "#56687a";
const VERTEX_PX = 5;
const LARGEST_ZOOM = 19;

interface RouteMapProps {
  fleet: Fleet;
  changes: readonly GeometryChange[];
  selected: string;
}

export default function RouteMap({ fleet, changes, selected }: RouteMapProps) {
  const host = useRef<HTMLDivElement>(null);
  useEffect(() => {
    if (!host.current) return undefined;
    const map = baseMap(host.current, fleet, null);
    const drawn = L.featureGroup(changes.flatMap(layersOf)).addTo(map);
    const wanted = changes.find(({ name }) => name === selected);
    const bounds = (wanted ? L.featureGroup(layersOf(wanted)) : drawn).getBounds();
    if (bounds.isValid()) map.fitBounds(bounds.pad(0.15), { maxZoom: LARGEST_ZOOM, animate: false });
    const resized = new ResizeObserver(() => map.invalidateSize({ animate: false }));
    resized.observe(host.current);
    return () => {
      resized.disconnect();
      map.remove();
    };
  }, [fleet, changes, selected]);
  return (
    <div class="cmp-map">
      <p class="m2-note">{words.mapHint}</p>
      <div ref={host} class="cmp-map-sheet" role="application" aria-label={words.map} />
    </div>
  );
}

function layersOf({ kind, before, after, gone, come }: GeometryChange): L.Layer[] {
  if (kind === "same") return after ? [shape(after, { color: SAME, weight: 2 })] : [];
  const layers: L.Layer[] = [];
  if (before) layers.push(shape(before, { color: BEFORE, weight: 3, dashArray: "7 7" }));
  if (after) layers.push(shape(after, { color: AFTER, weight: 3 }));
  const dot = (color: string, fill: boolean) => (vertex: (typeof gone)[number]) =>
    L.circleMarker(placeOf(vertex), {
      radius: VERTEX_PX,
      color,
      weight: 2,
      fillColor: fill ? color : "#fff",
      fillOpacity: 1,
    });
  return [...layers, ...gone.map(dot(BEFORE, false)), ...come.map(dot(AFTER, true))];
}

function shape(geometry: Geometry, style: L.PathOptions): L.Layer {
  const places = draftOf(geometry).vertices.map(placeOf);
  const path = { ...style, fillOpacity: 0.06 };
  const layer =
    geometry.kind === "area"
      ? L.polygon(places, path)
      : geometry.kind === "route"
        ? L.polyline(places, { ...path, fill: false })
        : L.circleMarker(places[0] ?? [0, 0], { ...path, radius: 8 });
  return layer.bindTooltip(document.createTextNode(geometry.name) as never);
}
