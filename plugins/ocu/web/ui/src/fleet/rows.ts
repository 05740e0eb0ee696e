// The lines of the table of the fleet: what is known of each vehicle and payload, as people sort,
// search and group it.
import { speed_m_s } from "../shared/format";
import { healthOf, isLow, rankOf, type Health } from "../map/health";
import type { Fleet, PayloadState, VehicleState } from "../shared/types";
import { locale } from "../strings/language";

export type Domain = Fleet["vehicles"][number]["domain"];
export type Filter = "lost" | "notReady" | "lowBattery" | "free" | "taken" | "inRun";
export type Grouping = "none" | "domain" | "arbiter" | "host" | "health" | "holder";
export type Column =
  | "name"
  | "health"
  | "link"
  | "battery"
  | "mode"
  | "holder"
  | "doing"
  | "speed"
  | "height"
  | "failsafe"
  | "position";

export const FILTERS: readonly Filter[] = [
  "lost",
  "notReady",
  "lowBattery",
  "free",
  "taken",
  "inRun",
];
export const GROUPINGS: readonly Grouping[] = [
  "none",
  "domain",
  "arbiter",
  "host",
  "health",
  "holder",
];
/** `unavailable` of a resource that was lost, is free again, and has done nothing since. */
const RETURNED = "returned: held";

/** What the executive says of a resource that is not just free: `GET /api/fleet/status`. */
export interface ResourceStatus {
  holder: string;
  run: string;
  task: string;
  direct: boolean;
  by: string;
  held: boolean;
  unavailable: string;
}

export interface Row {
  id: string;
  isPayload: boolean;
  /** Of a payload, its vehicle's. */
  domain: Domain;
  manned: boolean;
  arbiter: string;
  host: string;
  failsafe: string;
  /** How the vehicle's own differ from that; null: they were not compared. */
  failsafeProblems: readonly string[] | null;
  link: "connected" | "degraded" | "lost" | "unknown";
  /** Since when nothing is known of it, as the executive is not connected; null: it is. */
  unknownSince: number | null;
  /** Seconds since its last state; null: there was none. */
  age_s: number | null;
  battery: number | null;
  mode: string;
  armed: boolean | null;
  ready: boolean | null;
  reasons: readonly string[];
  latitude: number | null;
  longitude: number | null;
  height_m: number | null;
  yaw_rad: number | null;
  speed: number | null;
  health: Health;
  doing: string;
  status: ResourceStatus | null;
  /** Who has it: an operator, or "" . */
  operator: string;
  flags: Record<Filter, boolean>;
}

export interface Sources {
  fleet: Fleet;
  vehicles: Record<string, VehicleState>;
  payloads: Record<string, PayloadState>;
  status: Record<string, ResourceStatus>;
  silentFor_s(resource: string): number | null;
  /** When the executive said anything last, milliseconds since the Unix epoch; null: connected. */
  unknownSince: number | null;
}

const OF_RUN = /^r\d+\.\w+$/;

export function rowsOf(sources: Sources): Row[] {
  const { fleet } = sources;
  const payloads = new Map(fleet.payloads.map((payload) => [payload.id, payload]));
  return fleet.vehicles.flatMap((vehicle) => [
    rowOf(sources, vehicle.id, vehicle, vehicle.arbiter, sources.vehicles[vehicle.id]),
    ...vehicle.payloads.map((id) =>
      rowOf(sources, id, vehicle, payloads.get(id)?.arbiter ?? "", sources.payloads[id]),
    ),
  ]);
}

function rowOf(
  { status, silentFor_s, unknownSince }: Sources,
  id: string,
  { domain, manned, host, failsafe, id: owner }: Fleet["vehicles"][number],
  arbiter: string,
  state: VehicleState | PayloadState | undefined,
): Row {
  const isPayload = id !== owner;
  const vehicle = !isPayload ? (state as VehicleState | undefined) : undefined;
  const now = status[id] ?? null;
  const age_s = silentFor_s(id);
  const position = vehicle?.position ?? null;
  const battery = vehicle?.battery_fraction ?? null;
  // That nothing comes is no fault of the vehicle then.
  const isUnknown = unknownSince !== null;
  const isLost = state?.link === "lost";
  const operator = now && now.holder && !OF_RUN.test(now.holder) ? now.holder : "";
  const row = {
    id,
    isPayload,
    domain,
    manned,
    arbiter,
    host,
    failsafe: isPayload ? "" : failsafe,
    failsafeProblems: vehicle?.failsafe_problems ?? null,
    link: state?.link ?? ("unknown" as const),
    unknownSince,
    age_s,
    battery,
    mode: vehicle?.mode ?? "",
    armed: vehicle?.armed ?? null,
    ready: vehicle?.ready ?? null,
    reasons: vehicle?.not_ready_reasons ?? [],
    latitude: position?.latitude_deg ?? null,
    longitude: position?.longitude_deg ?? null,
    height_m: vehicle?.altitude_above_home_m ?? null,
    yaw_rad: vehicle?.yaw_rad ?? null,
    speed: vehicle?.velocity_enu_m_s ? speed_m_s(vehicle.velocity_enu_m_s) : null,
    doing: now?.task || state?.behavior || "",
    status: now,
    operator,
  };
  return {
    ...row,
    health: healthOf({
      isUnknown,
      isKnown: state !== undefined,
      isLost,
      ready: row.ready,
      isLow: isLow(battery),
      link: row.link,
    }),
    flags: {
      lost: isLost || state === undefined,
      notReady: row.ready === false,
      lowBattery: isLow(battery),
      free: !manned && (!now || isFree(now)),
      taken: operator !== "",
      // What an operator commands without having taken it is in a run of one task.
      inRun: now !== null && now.run !== "" && (!now.direct || operator === ""),
    },
  };
}

const isFree = ({ holder, run, unavailable }: ResourceStatus) =>
  !holder && !run && (!unavailable || unavailable === RETURNED);

/** The values by which a column sorts; null and "" come last, whichever way it sorts. */
export function keyOf(row: Row, column: Column): string | number | null {
  switch (column) {
    case "name":
      return row.id;
    case "health":
      return -rankOf(row.health);
    case "link":
      return row.age_s;
    case "battery":
      return row.battery;
    case "mode":
      return row.mode;
    case "holder":
      return row.operator || row.status?.run || "";
    case "doing":
      return row.doing;
    case "speed":
      return row.speed;
    case "height":
      return row.height_m;
    case "failsafe":
      return row.failsafe;
    case "position":
      return row.latitude;
  }
}

const byText = new Intl.Collator(locale, { numeric: true });

export interface Sorting {
  column: Column;
  descending: boolean;
}

export function sorted(rows: readonly Row[], { column, descending }: Sorting): Row[] {
  const sign = descending ? -1 : 1;
  const keyed = rows.map((row) => ({ row, key: keyOf(row, column) }));
  keyed.sort((one, other) => {
    const [a, b] = [one.key, other.key];
    const [noA, noB] = [a === null || a === "", b === null || b === ""];
    if (noA !== noB) return noA ? 1 : -1;
    const order =
      typeof a === "number" && typeof b === "number" ? a - b : byText.compare(`${a}`, `${b}`);
    return (noA ? 0 : order * sign) || byText.compare(one.row.id, other.row.id);
  });
  return keyed.map(({ row }) => row);
}

export interface Wanted {
  search: string;
  filters: ReadonlySet<Filter>;
  withPayloads: boolean;
}

/** Rows that have every word of the search, and one of the filters, if there are any. */
export function matching(rows: readonly Row[], { search, filters, withPayloads }: Wanted): Row[] {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean);
  return rows.filter((row) => {
    if (row.isPayload && !withPayloads) return false;
    if (filters.size > 0 && ![...filters].some((filter) => row.flags[filter])) return false;
    if (words.length === 0) return true;
    const text = searchedOf(row).toLowerCase();
    return words.every((word) => text.includes(word));
  });
}

const searchedOf = ({ id, domain, arbiter, host, mode, doing, operator, status, reasons }: Row) =>
  [id, domain, arbiter, host, mode, doing, operator, status?.run ?? "", ...reasons].join(" ");

export function counts(rows: readonly Row[], withPayloads: boolean): Record<Filter, number> {
  const found = { lost: 0, notReady: 0, lowBattery: 0, free: 0, taken: 0, inRun: 0 };
  for (const row of rows) {
    if (row.isPayload && !withPayloads) continue;
    for (const filter of FILTERS) if (row.flags[filter]) found[filter] += 1;
  }
  return found;
}

/** A line of the table: the head of a group, or a row. */
export type Line = { kind: "group"; group: string; count: number } | { kind: "row"; row: Row };

export function groupOf(row: Row, grouping: Grouping): string {
  switch (grouping) {
    case "none":
      return "";
    case "holder":
      return row.operator || row.status?.run || "";
    default:
      return row[grouping];
  }
}

/** Sorted rows, those of a group together; groups by name, of health the worst first. */
export function linesOf(rows: readonly Row[], grouping: Grouping): Line[] {
  if (grouping === "none") return rows.map((row) => ({ kind: "row", row }));
  const groups = new Map<string, Row[]>();
  for (const row of rows) {
    const group = groupOf(row, grouping);
    const known = groups.get(group);
    if (known) known.push(row);
    else groups.set(group, [row]);
  }
  const names = [...groups.keys()].sort((a, b) =>
    grouping === "health" ? rankOf(b as Health) - rankOf(a as Health) : byText.compare(a, b),
  );
  return names.flatMap((group): Line[] => {
    const found = groups.get(group)!;
    return [
      { kind: "group", group, count: found.length },
      ...found.map((row): Line => ({ kind: "row", row })),
    ];
  });
}
