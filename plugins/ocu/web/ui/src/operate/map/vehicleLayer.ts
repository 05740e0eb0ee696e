// Vehicles on the map: where they are, where they head, where they have been, what they see.
import { signal } from "@preact/signals";
import L from "leaflet";
import type { Fleet, GeoPosition, PayloadState, VehicleState } from "../../shared/types";
import { healthOf, isLow } from "../../map/health";
import { TrailLayer } from "../../map/trailLayer";
import { VehicleCanvas, type Mark } from "../../map/vehicleCanvas";
import { TRAIL_POINTS } from "../scene/scene";
import { GAP_S } from "./trail";

type Vehicle = Fleet["vehicles"][number];
export type VehicleMark = Extract<Mark, { kind: "vehicle" }>;

const FOOTPRINT: L.PolylineOptions = {
  color: "#d08a1d",
  weight: 1,
  fillOpacity: 0.1,
  interactive: false,
};
/** Nobody is read to more often where vehicles are. */
const LISTED_MS = 500;

interface Shown {
  state: VehicleState;
  receipt: Receipt;
  mark: VehicleMark;
}

/** Whether its state comes: not for a while, or not known, as nothing comes from the executive. */
export type Receipt = "current" | "stale" | "unknown";

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
  /** All that are drawn, wherever the map is, a moment after they are. */
  readonly listed = signal<readonly VehicleMark[]>([]);
  private readonly shown = new Map<string, Shown>();
  private readonly canvas: VehicleCanvas;
  private readonly trails = new TrailLayer(TRAIL_POINTS);
  private readonly footprints = L.layerGroup();
  private been: (resource: string) => GeoPosition[][] = () => [];
  private longest_s = GAP_S;
  private readonly seen = new Map<string, { polygon: L.Polygon; state: PayloadState }>();
  private listing: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly map: L.Map,
    private readonly fleet: Fleet,
  ) {
    this.canvas = new VehicleCanvas({
      marks: () => [...this.shown.values()].map(({ mark }) => mark),
      done: () => this.list(),
    }).addTo(map);
  }

  dispose(): void {
    clearTimeout(this.listing);
  }

  position(resource: string): L.LatLngTuple | null {
    const position = this.shown.get(resource)?.state.position;
    return position ? place(position) : null;
  }

  positions(): L.LatLngTuple[] {
    return [...this.shown.values()].map(({ mark }) => [mark.latitude, mark.longitude]);
  }

  /** The vehicle that is drawn at a place of the container. */
  at(point: L.Point): string | null {
    const mark = this.canvas.at(point);
    return mark?.kind === "vehicle" ? mark.vehicle.id : null;
  }

  choose(resource: string): void {
    this.canvas.choose(new Set(resource ? [resource] : []));
  }

  show({ trails, names, footprints }: Shows): void {
    this.turn(this.trails, trails);
    this.turn(this.footprints, footprints);
    this.canvas.showNames(names);
    this.map.getContainer().classList.toggle("map-nameless", !names);
  }

  /** `pace`: mission seconds in a second, in which more time passes between two states. */
  vehicles(states: Record<string, VehicleState>, pace: number): void {
    this.longest_s = GAP_S * Math.max(1, pace);
    for (const vehicle of this.fleet.vehicles) {
      const state = states[vehicle.id];
      const shown = this.shown.get(vehicle.id);
      if (!state?.position) {
        if (shown) this.remove(vehicle.id);
      } else if (shown?.state !== state) this.move(vehicle, shown, state, state.position);
    }
    this.canvas.redraw();
  }

  /** Draw trails anew: `been` says where a vehicle was, and where it is ends the trail. */
  retrace(been: (resource: string) => GeoPosition[][]): void {
    this.been = been;
    for (const [resource, { state }] of this.shown) this.trace(resource, state.position!);
  }

  /** What is not received for a while is drawn as lost, or as not known. */
  ages(receiptOf: (resource: string) => Receipt): void {
    for (const [resource, shown] of this.shown) {
      const now = receiptOf(resource);
      if (now === shown.receipt) continue;
      shown.receipt = now;
      const { health } = symbolOf(shown.mark.vehicle, shown.state, now);
      shown.mark = { ...shown.mark, vehicle: { ...shown.mark.vehicle, health } };
      this.canvas.redraw();
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

  private turn(layer: L.Layer, on: boolean): void {
    if (on) layer.addTo(this.map);
    else layer.remove();
  }

  private move(
    vehicle: Vehicle,
    shown: Shown | undefined,
    state: VehicleState,
    position: GeoPosition,
  ): void {
    const { latitude_deg: latitude, longitude_deg: longitude } = position;
    const mark: VehicleMark = {
      kind: "vehicle",
      vehicle: symbolOf(vehicle, state, "current"),
      latitude,
      longitude,
    };
    this.shown.set(vehicle.id, { state, receipt: "current", mark });
    if (!shown) return this.trace(vehicle.id, position);
    const since_s = (state.time_us - shown.state.time_us) / 1e6;
    this.trails.extend(vehicle.id, place(position), since_s, this.longest_s);
  }

  private trace(resource: string, end: GeoPosition): void {
    this.trails.replace(
      resource,
      this.been(resource).map((piece) => piece.map(place)),
    );
    this.trails.extend(resource, place(end), 0, this.longest_s);
  }

  private remove(resource: string): void {
    this.trails.forget(resource);
    this.shown.delete(resource);
  }

  private list(): void {
    this.listing ??= setTimeout(() => {
      this.listing = undefined;
      this.listed.value = [...this.shown.values()].map(({ mark }) => mark);
    }, LISTED_MS);
  }
}

const symbolOf = (
  { id, domain, manned }: Pick<Vehicle, "id" | "domain" | "manned">,
  { yaw_rad, link, ready, battery_fraction }: VehicleState,
  receipt: Receipt,
) => ({
  id,
  domain,
  manned,
  yaw_rad,
  health: healthOf({
    isKnown: true,
    isUnknown: receipt === "unknown",
    isLost: receipt === "stale" || link === "lost",
    ready,
    isLow: isLow(battery_fraction),
    link,
  }),
});
