// A run of the past, or a rehearsal, from its records: any moment of it, at any speed.
import { batch, computed, signal, type Signal } from "@preact/signals";
import { Reel } from "../../records/reel";
import { Spans } from "../../records/spans";
import type {
  Command,
  GeoPosition,
  PayloadState,
  Prompt,
  RunRecord,
  RunStatus,
  RunSummary,
  TeamState,
  VehicleState,
} from "../../shared/types";
import { historyOf, type TelemetryHistory } from "../plots/history";
import { ElementBoard } from "./elementBoard";
import { TRAIL_POINTS, type LogPage, type Scene } from "./scene";
import { TelemetryTrack, type Telemetry } from "./telemetryTrack";

export const SLOWEST = 0.25;
export const FASTEST = 100;

/** How people read: lists and clocks need no more than this many times a second. */
const TICK_MS = 100;

export class ReplayScene implements Scene {
  readonly mode = "replay";
  readonly elements = new ElementBoard();
  readonly summary;
  readonly status = signal<RunStatus | null>(null);
  readonly time = signal(0);
  readonly events = signal(0);
  readonly commands = signal<Record<string, Command>>({});
  readonly prompts = signal<Prompt[]>([]);
  readonly holders = signal<Record<string, string>>({});
  readonly vehicles = signal<Record<string, VehicleState>>({});
  readonly payloads = signal<Record<string, PayloadState>>({});
  readonly teams = signal<Record<string, TeamState>>({});
  readonly playing = signal(false);
  readonly speed = signal(1);
  readonly pace = computed(() => (this.playing.value ? this.speed.value : 0));
  readonly timeline;
  readonly log = signal<LogPage>({ records: [], more: false, skipped: 0 });
  readonly end;
  readonly hasTelemetry: boolean;
  readonly knownFrom_s: number;
  readonly telemetryProblem: string;
  readonly jumps = signal(0);
  private readonly reel: Reel;
  private readonly track: TelemetryTrack;
  private position_s = 0;
  private count = 0;
  private frame = 0;
  private before_ms = 0;
  private ticked_ms = 0;
  private known: Signal<{ history: TelemetryHistory }> | undefined;

  constructor(
    readonly run: string,
    summary: RunSummary,
    records: readonly RunRecord[],
    private readonly telemetry: Telemetry,
  ) {
    this.summary = signal<RunSummary | null>(summary);
    this.reel = new Reel(records);
    this.track = new TelemetryTrack(telemetry);
    this.hasTelemetry = this.track.moves;
    this.knownFrom_s = this.track.begin;
    this.telemetryProblem = telemetry.problem ?? "";
    this.end = signal(this.reel.end);
    const spans = new Spans();
    for (const record of records) spans.add(record);
    this.timeline = signal({ spans });
    this.seek(0);
  }

  get length(): number {
    return this.reel.length;
  }

  now(): number {
    return this.position_s;
  }

  /** Made when it is first asked for: not everybody looks at plots. */
  get history(): Signal<{ history: TelemetryHistory }> {
    if (!this.known) {
      const resources = Object.keys(this.telemetry.samples[0]?.vehicles ?? {}).length;
      const history = historyOf(this.telemetry, 2 * resources, this.end.value);
      this.known = signal({ history });
    }
    return this.known;
  }

  silentFor_s(resource: string): number | null {
    return this.track.silentFor_s(resource, this.position_s);
  }

  trail(resource: string): GeoPosition[][] {
    return this.track.trail(resource, this.position_s, TRAIL_POINTS);
  }

  /** All that happened up to and at this time. */
  seek(t: number): void {
    this.position_s = Math.max(0, Math.min(t, this.end.value));
    this.show(this.reel.countAt(this.position_s));
    this.tick();
    this.jumps.value += 1;
  }

  /** One record on, or back. */
  step(by: 1 | -1): void {
    this.pause();
    const count = Math.max(0, Math.min(this.count + by, this.reel.length));
    this.position_s = this.reel.records[count - 1]?.t ?? 0;
    this.show(count);
    this.tick();
    this.jumps.value += 1;
  }

  play(): void {
    if (this.playing.value) return;
    if (this.position_s >= this.end.value) this.seek(0);
    this.playing.value = true;
    this.before_ms = performance.now();
    this.frame = requestAnimationFrame((now_ms) => this.advance(now_ms));
  }

  pause(): void {
    this.playing.value = false;
    cancelAnimationFrame(this.frame);
    this.tick();
  }

  async older(): Promise<void> {
    // All of it is here.
  }

  dispose(): void {
    cancelAnimationFrame(this.frame);
  }

  private advance(now_ms: number): void {
    if (!this.playing.value) return;
    const passed_s = (Math.max(0, now_ms - this.before_ms) / 1000) * this.speed.value;
    this.before_ms = now_ms;
    this.position_s = Math.min(this.position_s + passed_s, this.end.value);
    this.show(this.reel.countAt(this.position_s));
    if (now_ms - this.ticked_ms >= TICK_MS) this.tick();
    if (this.position_s >= this.end.value) this.pause();
    else this.frame = requestAnimationFrame((next_ms) => this.advance(next_ms));
  }

  private show(count: number): void {
    batch(() => {
      if (this.track.moves) {
        const { vehicles, payloads, teams } = this.track.at(this.position_s);
        this.vehicles.value = vehicles;
        this.payloads.value = payloads;
        this.teams.value = teams;
      }
      if (count === this.count && this.status.value !== null) return;
      this.count = count;
      const view = this.reel.after(count);
      this.elements.replace(view.elements);
      this.commands.value = Object.fromEntries(view.commands);
      this.prompts.value = [...view.prompts.values()];
      this.holders.value = Object.fromEntries(view.holders);
      this.status.value = view.status;
      this.events.value = count;
    });
  }

  private tick(): void {
    this.ticked_ms = performance.now();
    batch(() => {
      this.time.value = this.position_s;
      if (this.log.value.records.length !== this.count) {
        const records = this.reel.records.slice(0, this.count);
        this.log.value = { records, more: false, skipped: 0 };
      }
    });
  }
}
