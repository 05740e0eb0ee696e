// What has to be read before a run or rehearsal can be shown.
import { signal, type Signal } from "@preact/signals";
import type { ReelPage } from "../records/reel";
import type { Span } from "../records/spans";
import { geometriesInFile, withOwn } from "../map/ownGeometry";
import { get } from "../shared/api";
import type { Fleet, Geometry, RunSummary } from "../shared/types";
import { missionModel, type MissionModel } from "./mission/missionModel";
import { readDefinitions } from "./mission/reading";
import { ReplayScene, type ReplayHead } from "./scene/replayScene";
import { loadTrack } from "./scene/telemetryPages";
import { NO_TELEMETRY, type Telemetry, type TelemetrySample } from "./scene/telemetryTrack";

export type Source = { kind: "run"; run: string } | { kind: "rehearsal"; id: string };

export interface Stage {
  mission: MissionModel;
  /** What distinguishes its files from those of another version. */
  files: string;
  fleet: Fleet;
  geometries: Signal<Geometry[]>;
}

interface MissionAnswer {
  name: string;
  process: string;
  files: { name: string; qualifier?: string; xml: string }[];
}

export const pathOf = (source: Source): string =>
  source.kind === "run"
    ? `/runs/${encodeURIComponent(source.run)}`
    : `/rehearsals/${encodeURIComponent(source.id)}`;

export async function loadStage(source: Source): Promise<Stage> {
  const [answer, fleet, geometries] = await Promise.all([
    get<MissionAnswer>(`${pathOf(source)}/mission`),
    get<Fleet>("/fleet"),
    get<Geometry[]>("/geometries"),
  ]);
  const sources = await Promise.all(
    answer.files.map(async ({ name, qualifier = "", xml }) => {
      return { name, qualifier, xml, definitions: await readDefinitions(xml) };
    }),
  );
  // The mission's own file is the first: what it has stands in place of what others have.
  const own = sources
    .map(({ xml }) => geometriesInFile(xml))
    .reduceRight((others, these) => withOwn(these, others), []);
  const mission = missionModel(sources, answer.process);
  const files = filesOf(answer);
  return { mission, files, fleet, geometries: signal(withOwn(own, geometries)) };
}

const filesOf = ({ files }: MissionAnswer): string =>
  JSON.stringify(files.map(({ name, xml }) => [name, xml]));

/** Whether a run has another version of its mission by now. */
export const isOutdated = async (source: Source, { files }: Stage): Promise<boolean> =>
  filesOf(await get<MissionAnswer>(`${pathOf(source)}/mission`)) !== files;

/** Of how many records of a long run the index is made by now. */
export interface Progress {
  done: number;
  records: number;
}

type ReplayAnswer =
  | ({ state: "making" } & Progress)
  | ({ state: "ready" } & ReplayHead);

/** How often it is asked how far an index is. */
const ASKED_EVERY_MS = 300;
/** For so long a replay waits for the vehicles' tracks, which then come later. */
const TELEMETRY_MS = 300;

async function loadHead(source: Source, progress: (made: Progress) => void): Promise<ReplayHead> {
  for (;;) {
    const answer = await get<ReplayAnswer>(`${pathOf(source)}/replay`);
    if (answer.state === "ready") return answer;
    progress(answer);
    await new Promise((resolve) => setTimeout(resolve, ASKED_EVERY_MS));
  }
}

/** A replay that shows the moment `at`, in seconds. */
export async function loadReplay(
  source: Source,
  summary: RunSummary,
  progress: (made: Progress) => void,
  at = 0,
): Promise<ReplayScene> {
  const telemetry = loadTelemetry(source);
  const path = `${pathOf(source)}/replay`;
  const head = await loadHead(source, progress);
  const run = source.kind === "run" ? source.run : "";
  const scene = new ReplayScene(run, summary, head, {
    page: (number) => get<ReelPage>(`${path}/pages/${number}`),
    spans: async ({ from_s, to_s }) =>
      (await get<{ spans: Span[] }>(`${path}/spans?from_s=${from_s}&to_s=${to_s}`)).spans,
  });
  const added = telemetry.then((found) => scene.addTelemetry(found));
  scene.seek(at);
  const waited = new Promise((resolve) => setTimeout(resolve, TELEMETRY_MS));
  await Promise.all([scene.settled(), Promise.race([added, waited])]);
  if (scene.problem.value) throw new Error(scene.problem.value);
  return scene;
}

/** A run can be looked at without its track: then it is said why there is none. */
async function loadTelemetry(source: Source): Promise<Telemetry> {
  try {
    if (source.kind === "rehearsal") {
      const samples = await get<TelemetrySample[]>(`${pathOf(source)}/telemetry`);
      return { samples, onlyNews: false, problem: null };
    }
    return await loadTrack(source.run);
  } catch (error) {
    return { ...NO_TELEMETRY, problem: error instanceof Error ? error.message : String(error) };
  }
}
