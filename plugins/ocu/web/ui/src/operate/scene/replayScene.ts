// A run of the past, or a rehearsal, from its records: any moment of it, at any speed. Records are
// read by pages around the moment that is shown.
import { batch, computed, signal, type Signal } from "@preact/signals";
import { Reel, type ReadReelPage, type ReelHead } from "../../records/reel";
import type { Bars, Span } from "../../records/spans";
import type { RunView } from "../../records/runView";
import type {
  Command,
  Debugging,
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
import type { Range } from "../plots/series";
import { detectionsOf, NO_DETECTIONS, type Detections } from "./detections";
import { ElementBoard } from "./elementBoard";
import { TRAIL_POINTS, type LogPage, type RecordedStop, type Requirements, type Scene } from "./scene";
import { NO_TELEMETRY, TelemetryTrack, type Telemetry } from "./telemetryTrack";

export const SLOWEST = 0.25;
export const FASTEST = 100;

/** How people read: lists and clocks need no more than this many times a second. */
const TICK_MS = 100;

/** Pages of records that the log has at first, and more of each time that older ones are wanted. */
const LOG_PAGES = 2;
/** More are not kept at once. */
const MOST_LOG_PAGES = 20;

/** What a slider, or a window that is dragged or zoomed, asks for when it rests. */
const RESTS_MS = 150;

/** `spans`: the bars of the whole run, of which short ones are merged if it is `thinned`. */
export interface ReplayHead extends ReelHead {
  rows: readonly string[];
  spans: readonly Span[];
  thinned: boolean;
  notable: readonly RunRecord[];
  stops: readonly RecordedStop[];
}

export interface ReplayReader {
  page: ReadReelPage;
  spans(range: Range): Promise<readonly Span[]>;
}

/** A moment that is to be shown: after `count` records, or at the time where the replay is. */
interface Target {
  page: number;
  count: number | null;
}

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
  readonly requirements = signal<Requirements>({});
  readonly debugging = signal<Debugging | null>(null);
  readonly vehicles = signal<Record<string, VehicleState>>({});
  readonly payloads = signal<Record<string, PayloadState>>({});
  readonly teams = signal<Record<string, TeamState>>({});
  readonly detections = signal<Detections>(NO_DETECTIONS);
  readonly playing = signal(false);
  readonly speed = signal(1);
  readonly pace = computed(() => (this.playing.value ? this.speed.value : 0));
  readonly timeline: Signal<{ spans: Bars }>;
  readonly log = signal<LogPage>({ records: [], more: false, skipped: 0 });
  readonly end;
  readonly jumps = signal(0);
  /** Whether records are read for the moment that is to be shown. */
  readonly loading = signal(false);
  /** Why that moment cannot be shown; "": it is shown, or will be. */
  readonly problem = signal("");
  private readonly reel: Reel;
  private readonly telemetry = signal<{ known: boolean; track: TelemetryTrack; of: Telemetry }>({
    known: false,
    track: new TelemetryTrack(NO_TELEMETRY),
    of: NO_TELEMETRY,
  });
  private position_s = 0;
  private target: Target = { page: 0, count: null };
  private shown: { page: number; count: number } | null = null;
  private logPages = LOG_PAGES;
  private chase: Promise<void> | null = null;
  private left = false;
  private frame = 0;
  private before_ms = 0;
  private ticked_ms = 0;
  /** After how many records the log is as it is shown. */
  private logged = -1;
  private looking: ReturnType<typeof setTimeout> | undefined;
  private logging: ReturnType<typeof setTimeout> | undefined;
  private readonly known = signal<{ history: TelemetryHistory } | null>(null);

  constructor(
    readonly run: string,
    summary: RunSummary,
    private readonly head: ReplayHead,
    private readonly reader: ReplayReader,
  ) {
    this.summary = signal<RunSummary | null>(summary);
    this.reel = new Reel(head, reader.page);
    this.end = signal(this.reel.end);
    this.timeline = signal({ spans: { all: head.spans, rows: head.rows } });
  }

  get length(): number {
    return this.reel.length;
  }

  get hasTelemetry(): boolean {
    return this.telemetry.value.track.moves;
  }

  get knownFrom_s(): number {
    const { known, track } = this.telemetry.value;
    return known ? track.begin : 0;
  }

  get telemetryProblem(): string {
    return this.telemetry.value.of.problem ?? "";
  }

  /** Where vehicles were; it may come after the records. */
  addTelemetry(telemetry: Telemetry): void {
    if (this.left) return;
    batch(() => {
      this.telemetry.value = { known: true, track: new TelemetryTrack(telemetry), of: telemetry };
      this.detections.value = detectionsOf(telemetry.samples);
      if (this.known.peek()) this.known.value = this.makeHistory();
      this.showVehicles();
      this.jumps.value += 1;
    });
  }

  now(): number {
    return this.position_s;
  }

  /** Made when it is first asked for: not everybody looks at plots. */
  get history(): Signal<{ history: TelemetryHistory }> {
    if (!this.known.peek()) this.known.value = this.makeHistory();
    return this.known as Signal<{ history: TelemetryHistory }>;
  }

  silentFor_s(resource: string): number | null {
    return this.telemetry.peek().track.silentFor_s(resource, this.position_s);
  }

  trail(resource: string): GeoPosition[][] {
    return this.telemetry.peek().track.trail(resource, this.position_s, TRAIL_POINTS);
  }

  notable(): readonly RunRecord[] {
    return this.head.notable;
  }

  get stops(): readonly RecordedStop[] {
    return this.head.stops;
  }

  /** All that happened up to and at this time; shown at once if its records are here. */
  seek(t: number): void {
    this.position_s = Math.max(0, Math.min(t, this.end.value));
    this.logPages = LOG_PAGES;
    this.showTime();
    this.tick();
    this.jumps.value += 1;
  }

  /** When the last moment that was asked for is shown, or cannot be. */
  async settled(): Promise<void> {
    while (this.chase) await this.chase;
  }

  /** One record on, or back. */
  step(by: 1 | -1): void {
    this.seekRecord((this.target.count ?? this.shown?.count ?? 0) + by);
  }

  seekRecord(wanted: number): void {
    this.pause();
    const count = Math.max(0, Math.min(wanted, this.reel.length));
    this.show({ page: this.reel.pageOf(count), count });
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
    this.logPages = Math.min(this.logPages + LOG_PAGES, MOST_LOG_PAGES);
    await this.readLog();
  }

  lookAt(range: Range | null): void {
    if (!this.head.thinned) return;
    clearTimeout(this.looking);
    const { spans: whole, rows } = this.head;
    if (!range) {
      this.timeline.value = { spans: { all: whole, rows } };
      return;
    }
    const timer = setTimeout(() => {
      // What is beside it comes too: it is there when the window is moved a little.
      const margin_s = (range.to_s - range.from_s) / 2;
      const wider = { from_s: Math.max(0, range.from_s - margin_s), to_s: range.to_s + margin_s };
      this.reader
        .spans(wider)
        .then((all) => {
          if (this.looking === timer) this.timeline.value = { spans: { all, rows } };
        })
        .catch((error: unknown) => this.fail(error));
    }, RESTS_MS);
    this.looking = timer;
  }

  dispose(): void {
    this.left = true;
    clearTimeout(this.looking);
    clearTimeout(this.logging);
    cancelAnimationFrame(this.frame);
  }

  private makeHistory(): { history: TelemetryHistory } {
    const { of } = this.telemetry.peek();
    const resources = Object.keys(of.samples[0]?.vehicles ?? {}).length;
    return { history: historyOf(of, 2 * resources, this.end.value) };
  }

  private advance(now_ms: number): void {
    if (!this.playing.value) return;
    const passed_s = (Math.max(0, now_ms - this.before_ms) / 1000) * this.speed.value;
    this.before_ms = now_ms;
    this.position_s = Math.min(this.position_s + passed_s, this.end.value);
    this.showTime();
    if (now_ms - this.ticked_ms >= TICK_MS) this.tick();
    if (this.position_s >= this.end.value) this.pause();
    else this.frame = requestAnimationFrame((next_ms) => this.advance(next_ms));
  }

  private showTime(): void {
    this.showVehicles();
    this.show({ page: this.reel.pageAt(this.position_s), count: null });
  }

  private show(target: Target): void {
    this.target = target;
    if (this.reel.has(target.page)) this.showPage(target.page);
    else this.chase ??= this.follow();
  }

  /** Read the page that is wanted, until it is the one that was read: the replay may go on. */
  private async follow(): Promise<void> {
    this.loading.value = true;
    try {
      while (!this.left && !this.reel.has(this.target.page)) {
        const { page } = this.target;
        await this.reel.read(page);
        this.problem.value = "";
        if (!this.left) this.showPage(page);
      }
    } catch (error) {
      this.fail(error);
    } finally {
      this.chase = null;
      this.loading.value = false;
    }
    if (!this.left) this.tick();
  }

  private fail(error: unknown): void {
    if (this.left) return;
    this.problem.value = error instanceof Error ? error.message : String(error);
    this.pause();
  }

  /** What is wanted, if it is in this page; its end or begin, if the replay has gone on meanwhile. */
  private showPage(page: number): void {
    const { page: wanted, count: exact } = this.target;
    const { reel } = this;
    let count = exact ?? reel.countAt(this.position_s);
    if (page !== wanted) count = (page + (wanted > page ? 1 : 0)) * this.head.page;
    else if (exact !== null) this.position_s = reel.timeOf(exact);
    if (this.shown?.page === page && this.shown.count === count) return;
    this.shown = { page, count };
    this.showView(reel.after(count, page));
    this.events.value = count;
    if (exact !== null) this.showVehicles();
    if (this.playing.peek()) void reel.read(page + 1).catch(() => undefined);
    // What the log has before it is read when the slider rests: moments come first.
    clearTimeout(this.logging);
    this.logging = setTimeout(() => void this.readLog(), RESTS_MS);
  }

  private showView(view: RunView): void {
    batch(() => {
      this.elements.replace(view.elements);
      this.commands.value = Object.fromEntries(view.commands);
      this.prompts.value = [...view.prompts.values()];
      this.holders.value = Object.fromEntries(view.holders);
      // Each requirement is replaced when it changes, so equal ones need not be drawn again.
      const before = Object.entries(this.requirements.peek());
      const same =
        before.length === view.requirements.size &&
        before.every(([id, each]) => view.requirements.get(id) === each);
      if (!same) this.requirements.value = Object.fromEntries(view.requirements);
      this.debugging.value = view.debugging;
      this.status.value = view.status;
    });
  }

  private showVehicles(): void {
    const { track } = this.telemetry.peek();
    if (!track.moves) return;
    const { vehicles, payloads, teams } = track.at(this.position_s);
    batch(() => {
      this.vehicles.value = vehicles;
      this.payloads.value = payloads;
      this.teams.value = teams;
    });
  }

  /** Read the pages that the log is to have, the newest first. */
  private async readLog(): Promise<void> {
    const last = this.reel.pageOf(this.shown?.count ?? 0);
    const missing = [...Array(this.logPages).keys()]
      .map((back) => last - back)
      .filter((page) => page >= 0 && !this.reel.has(page));
    if (missing.length === 0) return;
    try {
      for (const page of missing) await this.reel.read(page);
      if (!this.left) this.tick(true);
    } catch (error) {
      this.fail(error);
    }
  }

  private tick(renewsLog = false): void {
    this.ticked_ms = performance.now();
    const count = this.shown?.count ?? 0;
    batch(() => {
      this.time.value = this.position_s;
      if (!renewsLog && this.logged === count) return;
      this.logged = count;
      this.log.value = this.logPage(count);
    });
  }

  private logPage(count: number): LogPage {
    const last = this.reel.pageOf(count);
    let first = last + 1;
    while (first > 0 && first > last + 1 - this.logPages && this.reel.has(first - 1)) first -= 1;
    const isFull = this.logPages >= MOST_LOG_PAGES;
    return {
      records: this.reel.between(first, count),
      more: first > 0 && !isFull,
      cut: first > 0 && isFull,
      skipped: 0,
    };
  }
}
