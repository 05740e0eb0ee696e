// A run that goes on, from the messages of the executive.
import { batch, computed, signal } from "@preact/signals";
import { get } from "../../shared/api";
import * as executive from "../../shared/executive";
import type {
  Command,
  Debugging,
  GeoPosition,
  RunRecord,
  RunStatus,
  RunSummary,
  ServerMessage,
} from "../../shared/types";
import { historyOf, TelemetryHistory } from "../plots/history";
import { HistoryRecorder } from "../plots/recorder";
import { followResources } from "../vehicles/resources";
import { detectionsOf, NO_DETECTIONS, withDetections, type Detections } from "./detections";
import { ElementBoard } from "./elementBoard";
import { RecordFeed, type Page } from "./recordFeed";
import { TRAIL_POINTS, type Requirements, type Scene } from "./scene";
import { loadTrack } from "./telemetryPages";
import { NO_TELEMETRY, TelemetryTrack } from "./telemetryTrack";

const TICK_MS = 200;

/** A detection comes so much later, at most, than frames of its time. */
const LOOKED_BACK_S = 30;

type Frame = Extract<ServerMessage, { type: "frame" }>;
type Snapshot = Extract<ServerMessage, { type: "snapshot" }>;

export class LiveScene implements Scene {
  readonly mode = "live";
  readonly hasTelemetry = true;
  readonly knownFrom_s = 0;
  readonly telemetryProblem = "";
  readonly jumps = signal(0);
  readonly elements = new ElementBoard();
  readonly summary = computed<RunSummary | null>(
    () => executive.runs.value.find(({ run }) => run === this.run) ?? null,
  );
  readonly status = computed<RunStatus | null>(() => this.summary.value?.status ?? null);
  readonly time = signal(0);
  readonly pace = signal(1);
  readonly events = signal(0);
  readonly commands = signal<Record<string, Command>>({});
  readonly requirements = signal<Requirements>({});
  readonly debugging = signal<Debugging | null>(null);
  readonly stops = [];
  readonly prompts = executive.prompts;
  readonly holders = executive.holders;
  readonly vehicles = executive.vehicles;
  readonly payloads = executive.payloads;
  readonly teams = executive.teams;
  readonly detections = signal<Detections>(NO_DETECTIONS);
  readonly silentFor_s = executive.silentFor_s;
  readonly end = this.time;
  readonly history = signal({ history: new TelemetryHistory(0) });
  /** Once it is known what was before. */
  private recorder: HistoryRecorder | null = null;
  private readonly feed: RecordFeed;
  /** Of the time before the page was opened. */
  private before = new TelemetryTrack(NO_TELEMETRY);
  private begun = false;
  private toldAt = performance.now();
  private told_s = 0;
  private readonly stopListening: () => void;
  private readonly stopResources = followResources();
  private readonly ticking: ReturnType<typeof setInterval>;

  constructor(readonly run: string) {
    const path = `/runs/${encodeURIComponent(run)}/records`;
    this.feed = new RecordFeed((after, limit) =>
      get<Page>(`${path}?after=${after}&limit=${limit}&changes=false`),
    );
    this.stopListening = executive.listen((message) => this.take(message));
    this.ticking = setInterval(() => this.tick(), TICK_MS);
    executive.watch(run);
  }

  get timeline() {
    return this.feed.timeline;
  }

  get log() {
    return this.feed.log;
  }

  notable(): readonly RunRecord[] {
    return this.feed.log.peek().records;
  }

  lookAt(): void {
    // All bars are here.
  }

  older(): Promise<void> {
    return this.feed.older();
  }

  trail(resource: string): GeoPosition[][] {
    return this.before.trail(resource, Infinity, TRAIL_POINTS);
  }

  /** Frames come only when something changes; in between the clock goes on. */
  now(): number {
    if (this.status.value !== "running" || executive.connection.value !== "open")
      return this.told_s;
    return this.told_s + ((performance.now() - this.toldAt) / 1000) * this.pace.value;
  }

  dispose(): void {
    clearInterval(this.ticking);
    this.stopListening();
    this.stopResources();
    this.feed.dispose();
    executive.watch(null);
  }

  private async lookBack(): Promise<void> {
    let track = NO_TELEMETRY;
    try {
      track = await loadTrack(this.run);
      this.before = new TelemetryTrack(track);
      this.found(detectionsOf(track.samples));
      this.jumps.value += 1;
    } catch {
      // Trails and plots begin now, then.
    }
    const known = [this.vehicles.peek(), this.payloads.peek()];
    const expected = known.reduce((sum, states) => sum + Object.keys(states).length, 0);
    this.recorder = new HistoryRecorder(historyOf(track, expected, null));
    this.history.value = { history: this.recorder.history };
  }

  /** What was detected while the connection was interrupted. */
  private async lookAgain(since_s: number): Promise<void> {
    try {
      const { samples } = await loadTrack(this.run, since_s);
      const { all } = detectionsOf(samples);
      this.found({ all, more: 0 });
    } catch {
      // The next break, or the replay, has them.
    }
  }

  private found(detections: Detections): void {
    this.detections.value = withDetections(this.detections.peek(), detections);
  }

  private tick(): void {
    this.time.value = this.now();
    // Before the first snapshot it is not known what time it is.
    if (!this.begun || !this.recorder) return;
    const states = { vehicles: this.vehicles.peek(), payloads: this.payloads.peek() };
    const silentFor_s = (resource: string) => this.silentFor_s(resource);
    if (this.recorder.take(this.now(), performance.now(), states, silentFor_s)) {
      this.history.value = { history: this.recorder.history };
    }
  }

  private take(message: ServerMessage): void {
    switch (message.type) {
      case "snapshot":
        if (message.run === this.run) this.takeSnapshot(message);
        break;
      case "frame":
        if (message.run === this.run) this.takeFrame(message);
        break;
      case "detections":
        if (message.run === this.run) this.found({ all: message.detections, more: message.more });
        break;
      case "log":
        this.feed.push(message.records.filter(({ run }) => run === this.run));
        break;
    }
  }

  private takeSnapshot(snapshot: Snapshot): void {
    // What is detected from now on is sent; the track has what was detected before.
    if (this.begun) void this.lookAgain(Math.max(0, this.told_s - LOOKED_BACK_S));
    else void this.lookBack();
    batch(() => {
      this.clock(snapshot.t, snapshot.events);
      this.pace.value = snapshot.speed || 1;
      this.commands.value = present(snapshot.commands);
      this.requirements.value = present(snapshot.requirements);
      this.debugging.value = snapshot.debugging;
      this.elements.replace(snapshot.elements);
    });
    // After a break, what was missed comes with the next records that are pushed.
    if (!this.begun) void this.feed.begin(snapshot.events);
    this.begun = true;
  }

  private takeFrame(frame: Frame): void {
    this.clock(frame.t, frame.events);
    if (frame.elements) this.elements.merge(frame.elements);
    if (frame.requirements) {
      this.requirements.value = present({ ...this.requirements.value, ...frame.requirements });
    }
    if (frame.debugging !== undefined) this.debugging.value = frame.debugging;
    if (!frame.commands) return;
    this.commands.value = present({ ...this.commands.value, ...frame.commands });
    this.feed.settle(this.commands.value, frame.t);
  }

  private clock(t: number, events: number): void {
    this.told_s = t;
    this.toldAt = performance.now();
    this.events.value = events;
  }
}

function present<T>(values: Record<string, T | null>): Record<string, T> {
  return Object.fromEntries(
    Object.entries(values).filter((entry): entry is [string, T] => entry[1] !== null),
  );
}
