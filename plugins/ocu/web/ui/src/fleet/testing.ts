// Fleets for tests.
import type { Fleet, PayloadState, VehicleState } from "../shared/types";
import { rowsOf, type ResourceStatus, type Row } from "./rows";

export const vehicle = (id: string, more: object = {}): Fleet["vehicles"][number] => ({
  id,
  domain: "ground",
  manned: false,
  arbiter: "sim",
  host: "",
  failsafe: "",
  payloads: [],
  ...more,
});

export const state = (resource: string, more: Partial<VehicleState> = {}): VehicleState => ({
  resource,
  time_us: 0,
  position: { latitude_deg: 38, longitude_deg: -77, altitude_m: 0 },
  altitude_above_home_m: 0,
  velocity_enu_m_s: [3, 4, 0],
  yaw_rad: 0,
  battery_fraction: 0.8,
  mode: "auto",
  armed: true,
  ready: true,
  not_ready_reasons: [],
  link: "connected",
  behavior: "",
  failsafe_problems: null,
  ...more,
});

export const had = (more: Partial<ResourceStatus>): ResourceStatus => ({
  holder: "",
  run: "",
  task: "",
  direct: false,
  by: "",
  held: false,
  unavailable: "",
  ...more,
});

interface World {
  vehicles: Fleet["vehicles"];
  states?: VehicleState[];
  payloads?: Record<string, PayloadState>;
  status?: Record<string, ResourceStatus>;
  silent?: Record<string, number>;
  unknownSince?: number;
}

export function rows({ vehicles, states = [], payloads = {}, status = {}, silent = {}, unknownSince }: World): Row[] {
  const fleet: Fleet = {
    name: "f",
    origin: { lat: 0, lon: 0, alt: 0 },
    vehicles,
    payloads: vehicles.flatMap((each) =>
      each.payloads.map((id) => ({ id, vehicle: each.id, detector: false, arbiter: "onvif", video: null })),
    ),
    teams: [],
    fence: null,
    approval_persons: 0,
    may_be_debugged: true,
  };
  const known = Object.fromEntries(states.map((each) => [each.resource, each]));
  return rowsOf({
    fleet,
    vehicles: known,
    payloads,
    status,
    unknownSince: unknownSince ?? null,
    silentFor_s: (resource) => silent[resource] ?? (resource in known ? 0.2 : null),
  });
}
