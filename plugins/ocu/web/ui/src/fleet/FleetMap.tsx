// Where all vehicles are. A click chooses one, or gives the position that a command asks for.
import { effect } from "@preact/signals";
import L from "leaflet";
import { useEffect, useRef } from "preact/hooks";
import { baseMap } from "../map/baseMap";
import { session } from "../shared/session";
import type { Fleet, Geometry } from "../shared/types";
import { fill, strings } from "../strings";
import { FleetLayer } from "./fleetLayer";
import type { Row } from "./rows";
import {
  centred,
  destination,
  focused,
  middle,
  picking,
  select,
  selected,
  targets,
} from "./state";
import "../operate/map/map.css";

const text = strings.fleet.map;

const NEAR_ZOOM = 17;
const DRAWN = "#56687a";

export interface FleetMapProps {
  fleet: Fleet;
  geometries: readonly Geometry[];
  /** Vehicles that are shown: those of the table. */
  rows: readonly Row[];
  /** A position is picked by one click; else until the command is given, by the last click. */
  picksOnce: boolean;
}

export function FleetMap({ fleet, geometries, rows, picksOnce }: FleetMapProps) {
  const once = useRef(picksOnce);
  once.current = picksOnce;
  const host = useRef<HTMLDivElement>(null);
  const view = useRef<{ map: L.Map; layer: FleetLayer; fitted: boolean }>();

  useEffect(() => {
    const map = baseMap(host.current!, fleet, session.peek()?.tiles ?? null);
    const layer = new FleetLayer(map);
    view.current = { map, layer, fitted: false };
    middle.current = () => {
      const { lat, lng } = map.getCenter();
      return [lat, lng];
    };
    map.on("click", ({ latlng, containerPoint, originalEvent }) => {
      if (picking.value) {
        picking.value.picked(latlng.lat, latlng.lng);
        if (once.current) picking.value = null;
        return;
      }
      const mark = layer.at(containerPoint);
      if (mark?.kind === "cluster") {
        map.setView([mark.latitude, mark.longitude], layer.zoomOf(mark.id), { animate: false });
      } else if (mark) {
        const { id } = mark.vehicle;
        if (originalEvent.ctrlKey || originalEvent.metaKey || originalEvent.shiftKey) {
          select([id], !selected.value.has(id));
        } else focused.value = id;
      }
    });
    const resized = new ResizeObserver(() => map.invalidateSize({ animate: false }));
    resized.observe(host.current!);
    const stops = [
      effect(() => layer.choose(new Set([...selected.value, focused.value]))),
      effect(() => layer.aim(destination.value, targets())),
      effect(() => void map.getContainer().classList.toggle("map-drawing", !!picking.value)),
      centred.subscribe((wanted) => {
        const at = wanted && layer.position(wanted.resource);
        if (at) map.setView(at, Math.max(map.getZoom(), NEAR_ZOOM), { animate: false });
      }),
    ];
    return () => {
      for (const stop of stops) stop();
      resized.disconnect();
      middle.current = () => null;
      map.remove();
      view.current = undefined;
    };
  }, [fleet]);

  useEffect(() => {
    const now = view.current;
    if (!now) return;
    now.layer.load(rows);
    if (!now.fitted && now.layer.positions().length > 0 && now.map.getSize().x > 0) {
      fitAll(now.map, now.layer);
      now.fitted = true;
    }
  }, [rows, fleet]);

  useEffect(() => {
    const drawn = view.current && layersOf(geometries).addTo(view.current.map);
    return () => void drawn?.remove();
  }, [geometries, fleet]);

  return (
    <div class="fleet-map">
      <div ref={host} class="map" role="application" aria-label={text.label} />
      <button
        type="button"
        class="secondary fleet-map-fit"
        onClick={() => view.current && fitAll(view.current.map, view.current.layer)}
      >
        {text.fit}
      </button>
      {picking.value && (
        <p class="fleet-picking" role="status">
          {fill(text.picking, {
            parameter: picking.value.parameter,
            behavior: picking.value.behavior,
          })}{" "}
          <button type="button" class="secondary" onClick={() => (picking.value = null)}>
            {text.cancel}
          </button>
        </p>
      )}
      {!picking.value && rows.every(({ latitude }) => latitude === null) && (
        <p class="map-nobody">{text.noPositions}</p>
      )}
    </div>
  );
}

function layersOf(geometries: readonly Geometry[]): L.LayerGroup {
  const style = { color: DRAWN, weight: 2, fillOpacity: 0.06, interactive: false };
  return L.layerGroup(
    geometries.map(({ geometry }) =>
      L.geoJSON(geometry, {
        style,
        pointToLayer: (_, at) => L.circleMarker(at, { ...style, radius: 5 }),
      }),
    ),
  );
}

function fitAll(map: L.Map, layer: FleetLayer): void {
  const positions = layer.positions();
  if (positions.length === 0) return;
  map.fitBounds(L.latLngBounds(positions), { padding: [40, 40], maxZoom: 18, animate: false });
}
