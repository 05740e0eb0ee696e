// What the page shows of one run, wherever it comes from: the executive now, or records of the
// past.
import type { ReadonlySignal } from "@preact/signals";
import type { Bars } from "../../records/spans";
import type { Range } from "../plots/series";
import type { TelemetryHistory } from "../plots/history";
import type {
  Command,
  Debugging,
  GeoPosition,
  PayloadState,
  Prompt,
  Requirement,
  RunRecord,
  RunStatus,
  RunSummary,
  Stop,
  TeamState,
  VehicleState,
} from "../../shared/types";
import type { Detections } from "./detections";
import type { ElementBoard } from "./elementBoard";

/** Places of a trail. */
export const TRAIL_POINTS = 2000;

export type Requirements = Readonly<Record<string, Requirement>>;

/** A stop of a run that is over. `seq`: its record; `t`: mission time in seconds. */
export interface RecordedStop extends Stop {
  seq: number;
  t: number;
}

export interface LogPage {
  records: readonly RunRecord[];
  /** Whether there are older ones that were not read. */
  more: boolean;
  /** Records between those here that were not read: more came than anybody can follow. */
  skipped: number;
  /** Whether there are older ones, which are shown at an earlier time alone. */
  cut?: boolean;
}

export interface Scene {
  readonly mode: "live" | "replay";
  /** "": a rehearsal, which the executive does not know. */
  readonly run: string;
  readonly summary: ReadonlySignal<RunSummary | null>;
  readonly status: ReadonlySignal<RunStatus | null>;
  /** Mission time in seconds, a few times a second. */
  readonly time: ReadonlySignal<number>;
  /** Mission time at this very moment. */
  now(): number;
  /** Mission seconds in a second of the clock on the wall. */
  readonly pace: ReadonlySignal<number>;
  readonly events: ReadonlySignal<number>;
  readonly elements: ElementBoard;
  readonly commands: ReadonlySignal<Record<string, Command>>;
  readonly prompts: ReadonlySignal<Prompt[]>;
  readonly holders: ReadonlySignal<Record<string, string>>;
  /** What the run is monitored for, as it is known now, by id. */
  readonly requirements: ReadonlySignal<Requirements>;
  /** Where the run is paused to look at it; null: nowhere. */
  readonly debugging: ReadonlySignal<Debugging | null>;
  /** Where it was, of what is over. */
  readonly stops: readonly RecordedStop[];
  readonly vehicles: ReadonlySignal<Record<string, VehicleState>>;
  readonly payloads: ReadonlySignal<Record<string, PayloadState>>;
  readonly teams: ReadonlySignal<Record<string, TeamState>>;
  /** All that is known of: of a replay, also those of later than now. */
  readonly detections: ReadonlySignal<Detections>;
  /** Whether anything is known of where vehicles are and how: not of all runs of the past. */
  readonly hasTelemetry: boolean;
  /** From when on it is known, in seconds. */
  readonly knownFrom_s: number;
  /** Why it is not known, or has gaps; "": nothing went wrong. */
  readonly telemetryProblem: string;
  /** Where a vehicle has been up to now, the newest last; cut where nothing is known of it. */
  trail(resource: string): GeoPosition[][];
  /** Rises when trails are to be drawn again: time has jumped, or more is known of before. */
  readonly jumps: ReadonlySignal<number>;
  /** Seconds since the last state of a resource; null: there was none. */
  silentFor_s(resource: string): number | null;
  /** Numbers of vehicles and payloads up to now; they grow in place, and the signal tells it. */
  readonly history: ReadonlySignal<{ history: TelemetryHistory }>;
  /** Its `spans` may change in place; the signal tells that they did. */
  readonly timeline: ReadonlySignal<{ spans: Bars }>;
  /** Have the bars of a part of the time, or null: all of it, as finely as that part allows. */
  lookAt(range: Range | null): void;
  /** Records that the summary of an ended run is made of, as far as they are known. */
  notable(): readonly RunRecord[];
  readonly log: ReadonlySignal<LogPage>;
  /** Read older records for the log. */
  older(): Promise<void>;
  /** The whole length in seconds, of what is over. */
  readonly end: ReadonlySignal<number>;
  /** Show another moment, of what is over. */
  seek?(t: number): void;
  /** Show it as it was after so many records, of what is over. */
  seekRecord?(count: number): void;
  dispose(): void;
}
