// The operator page: a run that goes on, a run of the past, or a rehearsal.
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { ApiError, get } from "../shared/api";
import { isOver, listen } from "../shared/executive";
import { fill, strings } from "../strings";
import type { RunSummary } from "../shared/types";
import { operateContext, OperatingProvider, type OperateContext } from "./context";
import { Layout } from "./layout/Layout";
import { loadReplay, loadStage, pathOf, type Source, type Stage } from "./loading";
import { Player } from "./player/Player";
import { positionInAddress } from "./player/address";
import { PromptPanel } from "./prompts/PromptPanel";
import { RunBar } from "./runbar/RunBar";
import { RunEnd } from "./runbar/RunEnd";
import { LiveScene } from "./scene/liveScene";
import { ReplayScene } from "./scene/replayScene";
import { waitForRehearsal } from "./rehearsal";
import "./operate.css";

const text = strings.operate;

export default function Operate({ source }: { source: Source }) {
  const context = useSignal<OperateContext | null>(null);
  const problem = useSignal("");
  const progress = useSignal(0);
  const ended = useSignal(false);

  useEffect(() => {
    const page = new Opening(source, context, progress);
    page.open().catch((error: unknown) => (problem.value = problemOf(error, source)));
    const stop = listen((message) => {
      const here = source.kind === "run" && message.type === "run" && message.run.run === source.run;
      if (here && isOver(message.run) && context.peek()?.scene.mode === "live") ended.value = true;
    });
    return () => {
      stop();
      page.close();
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
    return (
      <p class="nothing" role="status">
        {progress.value > 0
          ? fill(text.replay.loading, { count: progress.value.toLocaleString() })
          : text.run.loading}
      </p>
    );
  }
  const { scene } = shown;
  const replay = async () => {
    ended.value = false;
    context.value = null;
    await new Opening(source, context, progress, shown).open();
  };
  return (
    <OperatingProvider value={shown}>
      <div class="operate">
        <h1 class="for-readers">{scene.run || text.run.rehearsal}</h1>
        <RunBar />
        <PromptPanel />
        <Layout
          key={scene.mode}
          onSeek={scene instanceof ReplayScene ? (t) => scene.seek(t) : undefined}
        />
        {scene instanceof ReplayScene && <Player scene={scene} />}
        {ended.value && (
          <RunEnd onReplay={() => void replay()} onClose={() => (ended.value = false)} />
        )}
      </div>
    </OperatingProvider>
  );
}

/** Reads what there is to show, unless the page is left meanwhile. */
class Opening {
  private left = false;

  constructor(
    private readonly source: Source,
    private readonly context: { value: OperateContext | null },
    private readonly progress: { value: number },
    private readonly known?: Stage,
  ) {}

  async open(): Promise<void> {
    const summary = await summaryOf(this.source);
    const stage = this.known ?? (await loadStage(this.source));
    const live = this.source.kind === "run" && !isOver(summary);
    const scene = live
      ? new LiveScene(summary.run)
      : await loadReplay(this.source, summary, (count) => (this.progress.value = count));
    if (this.left) {
      scene.dispose();
      return;
    }
    if (scene instanceof ReplayScene) scene.seek(positionInAddress() ?? 0);
    const { mission, fleet, geometries } = stage;
    this.context.value = operateContext({ scene, mission, fleet, geometries });
  }

  close(): void {
    this.left = true;
    this.context.value?.scene.dispose();
  }
}

function summaryOf(source: Source): Promise<RunSummary> {
  return source.kind === "run" ? get<RunSummary>(pathOf(source)) : waitForRehearsal(source.id);
}

function problemOf(error: unknown, source: Source): string {
  if (!(error instanceof ApiError)) return `${text.run.loadFailed} ${String(error)}`;
  if (error.status !== 404) return error.message;
  return fill(text.run.noRun, { run: source.kind === "run" ? source.run : source.id });
}
