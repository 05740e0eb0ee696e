// Vehicles on the map: where they are, where they head, where they have been, what they see.
import L from "leaflet";
import type { Fleet, GeoPosition, PayloadState, VehicleState } from "../../shared/types";
import { heading_deg } from "../../shared/format";
import { TRAIL_POINTS } from "../scene/scene";
import { GAP_S, isGap } from "./trail";
import { DOMAIN_PATHS } from "../vehicles/DomainSymbol";

type Vehicle = Fleet["vehicles"][number];

const TRAIL_STEP_M = 1;

const TRAIL: L.PolylineOptions = { color: "#3a7bd0", weight: 2, opacity: 0.65, interactive: false };
const FOOTPRINT: L.PolylineOptions = {
  color: "#d08a1d",
  weight: 1,
  fillOpacity: 0.1,
  interactive: false,
};

interface Shown {
  marker: L.Marker;
  trail: L.Polyline;
  state: VehicleState | undefined;
  symbol: SVGElement | null;
}

export interface Shows {
  trails: boolean;
  names: boolean;
  footprints: boolean;
}

const place = ({ latitude_deg, longitude_deg }: GeoPosition): L.LatLngTuple => [
  latitude_deg,
  longitude_deg,
];

/** Leaflet draws the whole map anew for a polygon that is only set to what it was. */
const isSame = (before: readonly GeoPosition[], now: readonly GeoPosition[]): boolean =>
  before.length === now.length &&
  before.every(
    ({ latitude_deg, longitude_deg }, index) =>
      latitude_deg === now[index]!.latitude_deg && longitude_deg === now[index]!.longitude_deg,
  );

export class VehicleLayer {
  private readonly shown = new Map<string, Shown>();
  private readonly trails = L.layerGroup();
  private readonly footprints = L.layerGroup();
  private been: (resource: string) => GeoPosition[][] = () => [];
  private longest_s = GAP_S;
  private readonly seen = new Map<string, { polygon: L.Polygon; state: PayloadState }>();

  constructor(
    private readonly map: L.Map,
    private readonly fleet: Fleet,
    private readonly chosen: (resource: string) => void,
  ) {}

  position(resource: string): L.LatLngTuple | null {
    const position = this.shown.get(resource)?.state?.position;
    return position ? place(position) : null;
  }

  positions(): L.LatLngTuple[] {
    return [...this.shown.keys()].flatMap((resource) => {
      const found = this.position(resource);
      return found ? [found] : [];
    });
  }

  show({ trails, names, footprints }: Shows): void {
    this.turn(this.trails, trails);
    this.turn(this.footprints, footprints);
    this.map.getContainer().classList.toggle("map-nameless", !names);
  }

  /** `pace`: mission seconds in a second, in which more time passes between two states. */
  vehicles(states: Record<string, VehicleState>, pace: number): void {
    this.longest_s = GAP_S * Math.max(1, pace);
    for (const vehicle of this.fleet.vehicles) {
      const state = states[vehicle.id];
      const shown = this.shown.get(vehicle.id);
      if (!state?.position) {
        if (shown) this.remove(vehicle.id, shown);
      } else if (shown?.state !== state) {
        this.move(shown ?? this.add(vehicle, state.position), state, state.position);
      }
    }
  }

  /** Draw trails anew: `been` says where a vehicle was, and where it is ends the trail. */
  retrace(been: (resource: string) => GeoPosition[][]): void {
    this.been = been;
    for (const [resource, { marker, trail }] of this.shown) {
      trail.setLatLngs(been(resource).map((piece) => piece.map((each) => L.latLng(place(each)))));
      this.extend(trail, marker.getLatLng(), 0);
    }
  }

  /** Gray where no state came for a while. */
  ages(isStale: (resource: string) => boolean): void {
    for (const [resource, { marker, state }] of this.shown) {
      const element = marker.getElement();
      element?.classList.toggle("vehicle-stale", isStale(resource));
      element?.classList.toggle("vehicle-lost", state?.link === "lost");
    }
  }

  payloads(states: Record<string, PayloadState>): void {
    for (const [resource, state] of Object.entries(states)) {
      const seen = this.seen.get(resource);
      if (seen?.state === state) continue;
      const polygon = seen?.polygon ?? L.polygon([], FOOTPRINT).addTo(this.footprints);
      if (!isSame(seen?.state.footprint ?? [], state.footprint)) {
        polygon.setLatLngs(state.footprint.map(place));
      }
      this.seen.set(resource, { polygon, state });
    }
    for (const [resource, { polygon }] of this.seen) {
      if (resource in states) continue;
      polygon.remove(); // a replay has gone back to before its first state
      this.seen.delete(resource);
    }
  }

  private turn(layer: L.LayerGroup, on: boolean): void {
    if (on) layer.addTo(this.map);
    else layer.remove();
  }

  private add(vehicle: Vehicle, position: GeoPosition): Shown {
    const icon = L.divIcon({
      className: `vehicle vehicle-${vehicle.domain} ${vehicle.manned ? "vehicle-manned" : ""}`,
      html: symbolOf(vehicle),
      iconSize: [28, 28],
    });
    const marker = L.marker(place(position), { icon, keyboard: false, zIndexOffset: 1000 });
    marker.on("click", () => this.chosen(vehicle.id)).addTo(this.map);
    const symbol = marker.getElement()?.querySelector("svg") ?? null;
    const trail = L.polyline(
      this.been(vehicle.id).map((piece) => piece.map(place)),
      TRAIL,
    ).addTo(this.trails);
    const shown: Shown = { marker, trail, state: undefined, symbol };
    this.shown.set(vehicle.id, shown);
    return shown;
  }

  private move(shown: Shown, state: VehicleState, position: GeoPosition): void {
    const at = L.latLng(place(position));
    if (!shown.marker.getLatLng().equals(at, 0)) shown.marker.setLatLng(at);
    if (state.yaw_rad !== null && shown.symbol) {
      shown.symbol.style.transform = `rotate(${heading_deg(state.yaw_rad).toFixed(1)}deg)`;
    }
    const before_us = shown.state?.time_us ?? state.time_us;
    this.extend(shown.trail, at, (state.time_us - before_us) / 1e6);
    shown.state = state;
  }

  /** Go on with a trail; after a gap, with a new piece of it. */
  private extend(trail: L.Polyline, at: L.LatLng, since_s: number): void {
    const known = (trail.getLatLngs() as L.LatLng[][]).filter(Array.isArray);
    const last = known.at(-1)?.at(-1);
    const step_m = last?.distanceTo(at) ?? Infinity;
    if (step_m < TRAIL_STEP_M) return;
    if (!last || isGap(since_s, step_m, this.longest_s)) known.push([at]);
    else known.at(-1)!.push(at);
    while (known.reduce((count, piece) => count + piece.length, 0) > TRAIL_POINTS) {
      known[0] = known[0]!.slice(TRAIL_POINTS / 4);
      if (known[0].length === 0) known.shift();
    }
    trail.setLatLngs(known);
  }

  private remove(resource: string, { marker, trail }: Shown): void {
    marker.remove();
    trail.remove();
    this.shown.delete(resource);
  }
}

function symbolOf({ id, domain }: Vehicle): string {
  const name = document.createElement("span");
  name.textContent = id;
  return `<svg viewBox="0 0 24 24" aria-hidden="true"><path d="${DOMAIN_PATHS[domain]}"/></svg>${name.outerHTML}`;
}
