// The operator page: a run that goes on, a run of the past, or a rehearsal.
import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { ConfirmOrder } from "../fleet/ConfirmOrder";
import { listingVersions, revising } from "../revise/revising";
import { ApiError, get } from "../shared/api";
import { activeRuns, connection, isOver, listen } from "../shared/executive";
import { loaded } from "../shared/loaded";
import { fill, strings } from "../strings";
import type { RunSummary, ServerMessage } from "../shared/types";
import { operateContext, OperatingProvider, useOperating, type OperateContext } from "./context";
import { elementMenu, useBreakpointKey } from "./debug/menu";
import { Layout } from "./layout/Layout";
import {
  isOutdated,
  loadReplay,
  loadStage,
  pathOf,
  type Progress,
  type Source,
  type Stage,
} from "./loading";
import { Player } from "./player/Player";
import { positionInAddress } from "./player/address";
import { IncidentPanel } from "./prompts/IncidentPanel";
import { PromptPanel } from "./prompts/PromptPanel";
import { RunBar } from "./runbar/RunBar";
import { RunEnd } from "./runbar/RunEnd";
import { LiveScene } from "./scene/liveScene";
import { ReplayScene } from "./scene/replayScene";
import type { Scene } from "./scene/scene";
import { waitForRehearsal } from "./rehearsal";
import "./operate.css";
import { grouped } from "../shared/format";

const text = strings.operate;

const StopBanner = loaded(() => import("./debug/StopBanner"));
const ElementMenu = loaded(() => import("./debug/ElementMenu"));
const ReviseDialog = loaded(() => import("../revise/ReviseDialog"));
const RunVersions = loaded(() => import("../revise/RunVersions"));

export default function Operate({ source }: { source: Source }) {
  useEffect(
    () => () => {
      revising.value = null;
      listingVersions.value = "";
    },
    [],
  );
  const listed = listingVersions.value;
  return (
    <>
      <Shown source={source} />
      {revising.value && (
        <ReviseDialog {...revising.value} onClose={() => (revising.value = null)} />
      )}
      {listed && (
        <RunVersions
          run={listed}
          isLive={activeRuns.value.some(({ run }) => run === listed)}
          onClose={() => (listingVersions.value = "")}
        />
      )}
    </>
  );
}

/** The run or rehearsal itself. It is drawn again when the run gets a new version. */
function Shown({ source }: { source: Source }) {
  const context = useSignal<OperateContext | null>(null);
  const problem = useSignal("");
  const opened = useSignal<Opened | null>(null);
  const ended = useSignal(false);
  const opening = useRef<Opening>();
  const stage = useRef<Stage | null>(null);
  /** The record of the last revision that is known here. */
  const revisedAt = useRef(0);

  const open = (known?: Stage) => {
    opening.current?.close();
    context.value = null;
    ended.value = false;
    opening.current = new Opening(source, (found) => (opened.value = found), known);
    opening.current
      .open((parts, hasEnded) => {
        stage.current = parts;
        context.value = operateContext({ ...parts, replay: () => open(parts) });
        ended.value = hasEnded;
      })
      .catch((error: unknown) => (problem.value = problemOf(error, source)));
  };

  /** The diagram is that of the version which holds now, and so are the names. */
  const renew = async () => {
    const [before, known] = [opening.current, stage.current];
    if (known && !(await isOutdated(source, known))) return;
    if (opening.current === before) open();
  };

  useEffect(() => {
    open();
    const stop = listen((message) => {
      const here =
        source.kind === "run" && message.type === "run" && message.run.run === source.run;
      const live = context.peek()?.scene.mode === "live";
      if (here && isOver(message.run) && live) ended.value = true;
      if (!live || source.kind !== "run") return;
      // What comes first is the newest of what was before, revisions that the page shows, too.
      const seq = lastRevision(message, source.run);
      if (seq <= revisedAt.current) return;
      revisedAt.current = seq;
      renew().catch((error: unknown) => console.warn(error));
    });
    return () => {
      stop();
      opening.current?.close();
      opening.current = undefined;
    };
  }, []);

  if (problem.value) {
    return (
      <p class="nothing" role="alert">
        {problem.value}
      </p>
    );
  }
  const shown = context.value;
  if (!shown) {
    return <Loading {...opened.value} />;
  }
  const { scene } = shown;
  const isReplay = scene instanceof ReplayScene;
  const stale = isReplay ? "" : ` operate-live${connection.value === "open" ? "" : " stale"}`;
  return (
    <OperatingProvider value={shown}>
      <div class={`operate${stale}`}>
        <h1 class="for-readers">{scene.run || text.run.rehearsal}</h1>
        <RunBar />
        <Debugged />
        {!isReplay && <PromptPanel />}
        {!isReplay && <IncidentPanel />}
        <Layout key={scene.mode} onSeek={isReplay ? (t) => scene.seek(t) : undefined} />
        {isReplay && <Player scene={scene} />}
        {!isReplay && <ConfirmOrder />}
        {ended.value && <RunEnd onClose={() => (ended.value = false)} />}
      </div>
    </OperatingProvider>
  );
}

/** Where it is stopped to look at it, and the menu at an element. */
function Debugged() {
  const { scene } = useOperating();
  useBreakpointKey();
  useEffect(() => () => void (elementMenu.value = null), []);
  const { reached, stepping } = scene.debugging.value ?? {};
  return (
    <>
      {(reached || (stepping && scene.mode === "live")) && <StopBanner />}
      {elementMenu.value && <ElementMenu />}
    </>
  );
}

/** What is known of a run before it can be shown. */
interface Opened {
  summary?: RunSummary;
  made?: Progress;
}

/** How a long run ended is said before its replay can be shown. */
function Loading({ summary, made }: Opened) {
  if (!summary || !made) {
    return (
      <p class="nothing" role="status">
        {text.run.loading}
      </p>
    );
  }
  const { done, records } = made;
  return (
    <section class="opening" aria-label={text.replay.label}>
      <p>
        <strong class={`status status-${summary.status}`}>{text.run.status[summary.status]}</strong>{" "}
        {summary.run} {summary.mission}
      </p>
      {summary.detail && <p>{summary.detail}</p>}
      <label>
        {text.replay.making}
        <progress max={records} value={done} />
      </label>
      <p role="status">
        {fill(text.replay.made, {
          done: grouped(done),
          records: grouped(records),
        })}
      </p>
    </section>
  );
}

/** The last record by which a message says that a run goes on with a new version; 0: none. */
function lastRevision(message: ServerMessage, run: string): number {
  if (message.type !== "log") return 0;
  const found = message.records.filter(
    (each) => each.run === run && each.record === "MissionRevised",
  );
  return found.at(-1)?.seq ?? 0;
}

/** Reads what there is to show, unless the page is left meanwhile. */
class Opening {
  private left = false;
  private scene: Scene | undefined;

  constructor(
    private readonly source: Source,
    private readonly opened: (found: Opened) => void,
    private readonly known?: Stage,
  ) {}

  /** `show` is also told whether the end of a run is to be said that was over before. */
  async open(show: (parts: Stage & { scene: Scene }, hasEnded: boolean) => void): Promise<void> {
    const summary = await summaryOf(this.source);
    this.opened({ summary });
    const live = this.source.kind === "run" && !isOver(summary);
    // A run that is over is shown as it ended, unless its replay was asked for here.
    const position = positionInAddress();
    const hasEnded = !live && this.source.kind === "run" && !this.known && position === null;
    const at = position ?? (hasEnded ? Infinity : 0);
    const progress = (made: Progress) => this.opened({ summary, made });
    const [stage, replayed] = await Promise.all([
      this.known ?? loadStage(this.source),
      live ? null : loadReplay(this.source, summary, progress, at),
    ]);
    if (this.left) replayed?.dispose();
    if (this.left) return;
    this.scene = replayed ?? new LiveScene(summary.run);
    show({ ...stage, scene: this.scene }, hasEnded);
  }

  close(): void {
    this.left = true;
    this.scene?.dispose();
  }
}

function summaryOf(source: Source): Promise<RunSummary> {
  return source.kind === "run" ? get<RunSummary>(pathOf(source)) : waitForRehearsal(source.id);
}

function problemOf(error: unknown, source: Source): string {
  if (!(error instanceof ApiError))
    return `${text.run.loadFailed} ${error instanceof Error ? error.message : ""}`;
  if (error.status !== 404) return error.message;
  return fill(text.run.noRun, { run: source.kind === "run" ? source.run : source.id });
}
