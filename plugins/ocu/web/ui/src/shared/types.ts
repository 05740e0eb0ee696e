// What the server and the page tell each other. Times in seconds or, with `_us`, in microseconds
// since the Unix epoch; positions WGS-84 degrees; units as the names say.

export type Role = "viewer" | "operator" | "commander";

export interface Session {
  user: string;
  role: Role;
  fleet: string;
  simulated: boolean;
  version: string;
  missions_folder: string;
  /** Served at /tiles/{z}/{x}/{y}.png; null: there are none. */
  tiles: { max_zoom: number; attribution: string } | null;
}

/** An executive that stands by. `page`: the address of its page; "": it has none. */
export interface Standby {
  host: string;
  pid: number;
  page: string;
}

/** A session that has just begun; `key` is the header M2pem-Key of every request. */
export interface BegunSession extends Session {
  key: string;
}

export interface Finding {
  severity: "error" | "warning";
  rule: string;
  number: string;
  file: string;
  line: number;
  element: string;
  message: string;
  remedy: string;
  /** Latitude and longitude in degrees, of what has a place. */
  place?: [number, number] | null;
}

export interface Parameter {
  name: string;
  kind: string;
  unit: string;
  required: boolean;
  minimum: number | null;
  maximum: number | null;
  choices: string[];
  default: number | string | boolean | null;
  doc: string;
}

/** A behavior, with who of the fleet can do it. */
export interface Behavior {
  name: string;
  type: "vehicle" | "payload" | "team";
  doc: string;
  ends: boolean;
  writes: string[];
  required_one_of: string[][];
  parameters: Parameter[];
  resources: string[];
  teams: string[];
}

/** Where a camera's pictures come from. `every_s`: of kind image, between two of them. */
export interface Video {
  url: string;
  kind: "hls" | "webrtc" | "mjpeg" | "image";
  every_s: number;
}

export interface Fleet {
  name: string;
  origin: { lat: number; lon: number; alt: number };
  vehicles: {
    id: string;
    domain: "ground" | "air" | "surface" | "subsurface";
    manned: boolean;
    arbiter: string;
    /** Of its arbiter; "": the executive's own. */
    host: string;
    /** What the fleet file says that it does when its link is lost; "": nothing. */
    failsafe: string;
    payloads: string[];
  }[];
  payloads: {
    id: string;
    vehicle: string;
    detector: boolean;
    arbiter: string;
    video: Video | null;
  }[];
  teams: { name: string; members: string[]; lead: string }[];
  /** No vehicle may leave it. */
  fence: GeoJSON.Geometry | null;
  /** How many persons must approve a mission before it starts. */
  approval_persons: number;
  /** Whether its runs may be: all of it is simulated, or its file allows that. */
  may_be_debugged: boolean;
}

/** What altitudes are above: home, the sea, the ground, or (in files) the WGS-84 ellipsoid. */
export type AltitudeFrame = "relative" | "amsl" | "terrain" | "ellipsoid";

export interface Geometry {
  name: string;
  kind: "route" | "area" | "point";
  geometry: GeoJSON.Geometry;
  altitude_frame: AltitudeFrame;
  /** Of a route with speeds: one for each waypoint. */
  speeds_m_s?: readonly (number | null)[];
  /** Of a route whose waypoints have different ones; `altitude_frame` is that of the first. */
  altitude_frames?: readonly AltitudeFrame[];
  from: "fleet" | "operator" | "mission";
  by: string;
  at_us: number | null;
  /** Of the mission's own: the pattern of the survey that it is a part of, and whose part. */
  survey?: { pattern: string; surveyor: string };
}

export interface MissionLine {
  name: string;
  title: string;
  version: string;
  saved_at_us: number;
  by: string;
  runnable: boolean;
}

export interface MissionFile {
  name: string;
  xml: string;
  version: string;
  saved_at_us: number;
  by: string;
  notes: string[];
}

export interface OutlineElement {
  id: string;
  name: string;
  type: string;
  process: string;
  parent: string;
}

export interface Outline {
  processes: { id: string; name: string; executable: boolean; starts: boolean }[];
  elements: OutlineElement[];
  names: { name: string; from: string }[];
  signals: { id: string; name: string; operators: boolean }[];
  messages: { id: string; name: string; operators: boolean }[];
}

export interface Check {
  findings: Finding[];
  outline: Outline | null;
}

export type RunStatus =
  | "running"
  | "paused"
  | "interrupted"
  | "completed"
  | "terminated"
  | "failed"
  | "stopped";

export interface RunSummary {
  run: string;
  mission: string;
  process: string;
  status: RunStatus;
  started_us: number;
  ended_us: number | null;
  records: number;
  detail: string;
  /** By the clock on the wall; those above are by the executive's, which may run faster. */
  began_us: number;
}

/** As it stands now. `took_s`: null when no executive drives it. */
export interface RunLine extends RunSummary {
  took_s: number | null;
}

export type ScheduledStatus =
  | "scheduled"
  | "waiting"
  | "starting"
  | "held"
  | "ended"
  | "cancelled"
  | "failed";

/** A mission that starts later. Times by the executive's clock; null: there is none. */
export interface ScheduledMission {
  entry: string;
  mission: string;
  process: string;
  when: string;
  time_zone: string;
  status: ScheduledStatus;
  priority: number;
  by: string;
  next_us: number | null;
  due_us: number | null;
  deadline_us: number | null;
  starts_us: number | null;
  reason: string;
  run: string;
}

/** `hold`: who holds all of it, and why; "": no operator. */
export interface Schedule {
  hold: string;
  served: boolean;
  warning_s: number;
  entries: ScheduledMission[];
}

export interface SpaceHolder {
  vehicle: string;
  /** "": it is at rest there. */
  behavior: string;
  lost: boolean;
}

export interface WaitingTask {
  run: string;
  allocation: string;
  task: string;
  waited_s: number;
  reason: string;
  /** Who has what it could use, by resource or space. */
  holders: Record<string, string>;
}

/** An area, or a corridor of `width_m` along a route, in which few vehicles may be at a time. */
export interface SharedSpace {
  name: string;
  capacity: number;
  geometry: GeoJSON.Geometry;
  width_m: number | null;
  holders: SpaceHolder[];
  waiting: WaitingTask[];
}

export type LogKind = "run" | "tokens" | "behaviors" | "prompts" | "events" | "data" | "operators";

/** What a record changes in the view of its run; null: it is there no more. */
export interface RecordChanges {
  elements?: Elements;
  commands?: Record<string, Command | null>;
  prompts?: Record<string, Prompt | null>;
  holders?: Record<string, string | null>;
  requirements?: Record<string, Requirement | null>;
  debugging?: Debugging | null;
  status?: RunStatus;
  detail?: string;
}

/**
 * A record, with its own fields beside these (docs/records.md). Pages of records have `changes`,
 * records that are pushed have not.
 */
export interface RunRecord {
  run: string;
  seq: number;
  t: number;
  record: string;
  sentence: string;
  kind: LogKind;
  urgent: boolean;
  changes?: RecordChanges;
  token?: number;
  process?: string;
  element?: string;
  scope?: number;
  [more: string]: unknown;
}

export interface Prompt {
  run: string;
  prompt: string;
  process: string;
  element: string;
  text: string;
  decisions: { value: string; label: string }[];
  role: string;
}

export interface ElementState {
  active: number;
  hits: number;
  last: number;
  failed: boolean;
  asking: boolean;
  /** A task of it waits for vehicles or payloads that are not free. */
  waiting: boolean;
  /** An incident stops a token on it. */
  stopped?: boolean;
}

export interface Command {
  name: string;
  resources: string[];
  process: string;
  element: string;
  since: number;
}

/**
 * What a run is monitored for. `since`, `because`: from when on it is certain, and by what; `recorded`:
 * when the run had the record of it. `elements`: those that it is about. `on_violation`: what a
 * violation throws in the mission; "": nothing.
 */
export interface Requirement {
  english: string;
  formula: string;
  elements: string[];
  on_violation: string;
  verdict: "open" | "satisfied" | "violated";
  since: number | null;
  recorded: number | null;
  because: string;
}

/** Why and where a run was paused that is debugged; "": no element is next. */
export interface Stop {
  reason: "breakpoint" | "condition" | "step";
  condition: string;
  process: string;
  element: string;
}

/** What is around what is next; `instance`: of a loop or multi-instance activity, from 0. */
export interface Around {
  process: string;
  element: string;
  instance: number | null;
}

/** `token`, in `scope`, sees the data of what is next; 0: nothing is. `within`: from the outside in. */
export interface Reached extends Stop {
  token: number;
  scope: number;
  instance: number | null;
  within: Around[];
  resources: string[];
}

/** Where a run is paused to look at it. `stepping`: it is paused before its next step. */
export interface Debugging {
  elements: string[];
  conditions: string[];
  stepping: boolean;
  reached: Reached | null;
}

export interface GeoPosition {
  latitude_deg: number;
  longitude_deg: number;
  altitude_m: number;
}

export interface VehicleState {
  resource: string;
  time_us: number;
  position: GeoPosition | null;
  altitude_above_home_m: number | null;
  velocity_enu_m_s: [number, number, number] | null;
  yaw_rad: number | null;
  battery_fraction: number | null;
  mode: string;
  armed: boolean | null;
  ready: boolean | null;
  not_ready_reasons: string[];
  link: "connected" | "degraded" | "lost";
  behavior: string;
  /** How its failsafes differ from what the fleet file says; null: they were not compared. */
  failsafe_problems?: string[] | null;
  /** An aircraft is on the ground, as its autopilot says. */
  landed?: boolean | null;
  home?: GeoPosition | null;
}

export interface PayloadState {
  resource: string;
  time_us: number;
  pan_rad: number | null;
  tilt_rad: number | null;
  zoom: number | null;
  link: "connected" | "degraded" | "lost";
  behavior: string;
  footprint: GeoPosition[];
}

/** Something that a payload detected. A later one of the same number replaces the one before. */
export interface Detection {
  number: number;
  /** Mission time. */
  t_s: number;
  type: string;
  source: string;
  /** Null: the device did not know it. */
  position: { latitude_deg: number | null; longitude_deg: number | null; altitude_m: number | null };
  time_us: number;
  /** The camera that was asked for a picture; "" or left out: there is none. */
  camera?: string;
  /** The number with which the picture is had, and how much later that had come. */
  picture?: number;
  picture_after_s?: number;
  /** Why there is no picture. */
  no_picture?: string;
}

export interface TeamState {
  behavior: string;
  name: string;
  time_us: number;
  members: { resource: string; along_m: number | null; aside_m: number | null; gap_m: number | null }[];
  spacing_m: number;
}

export type Elements = Record<string, Record<string, ElementState>>;

/** What is new since the last frame; a snapshot has all of it. */
export interface Live {
  seq: number;
  /** The executive's clock, in seconds: it only rises. */
  now: number;
  run: string | null;
  t: number;
  events: number;
  elements: Elements;
  vehicles: Record<string, VehicleState>;
  payloads: Record<string, PayloadState>;
  teams: Record<string, TeamState>;
  commands: Record<string, Command | null>;
  requirements: Record<string, Requirement | null>;
  debugging: Debugging | null;
  holders: Record<string, string>;
  runs: RunSummary[];
}

export type ServerMessage =
  | ({ type: "snapshot"; status: RunStatus | null; speed: number; prompts: Prompt[] } & Live)
  | ({ type: "frame" } & Pick<Live, "seq" | "run" | "now" | "t" | "events"> & Partial<Live>)
  | { type: "prompt"; seq: number; prompt: Prompt }
  | { type: "prompt_closed"; seq: number; run: string; prompt: string; decision: string; by: string }
  | { type: "run"; seq: number; run: RunSummary }
  | { type: "detections"; seq: number; run: string; detections: Detection[]; more: number }
  | { type: "fault"; seq: number; text: string }
  | { type: "notice"; seq: number; text: string }
  | { type: "alerts"; seq: number }
  | { type: "operators"; seq: number }
  | { type: "comments"; seq: number; mission: string }
  | { type: "schedule"; seq: number }
  | { type: "shared_space"; seq: number }
  | { type: "alive"; seq: number }
  | { type: "log"; seq: number; records: RunRecord[] };

/** What follows. `english`: what a requirement says; `text`: verdict and reason in a sentence. */
export interface Outlook {
  verdict: string;
  reason: string;
  text: string;
  requirements: { requirement: string; english: string; verdict: string; text: string }[];
}
