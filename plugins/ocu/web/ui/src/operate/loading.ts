// What has to be read before a run or rehearsal can be shown.
import { signal, type Signal } from "@preact/signals";
import { geometriesInFile, withOwn } from "../map/ownGeometry";
import { get } from "../shared/api";
import type { Fleet, Geometry, RunRecord, RunSummary } from "../shared/types";
import { missionModel, type MissionModel } from "./mission/missionModel";
import { readDefinitions } from "./mission/reading";
import type { Page } from "./scene/recordFeed";
import { ReplayScene } from "./scene/replayScene";
import { loadTrack } from "./scene/telemetryPages";
import { NO_TELEMETRY, type Telemetry, type TelemetrySample } from "./scene/telemetryTrack";

export type Source = { kind: "run"; run: string } | { kind: "rehearsal"; id: string };

export interface Stage {
  mission: MissionModel;
  fleet: Fleet;
  geometries: Signal<Geometry[]>;
}

interface MissionAnswer {
  name: string;
  process: string;
  files: { name: string; qualifier?: string; xml: string }[];
}

const PAGE = 5000;

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
  return { mission, fleet, geometries: signal(withOwn(own, geometries)) };
}

/** All records, page by page; `progress` is called with how many there are so far. */
export async function loadRecords(
  source: Source,
  progress: (count: number) => void,
): Promise<RunRecord[]> {
  const records: RunRecord[] = [];
  let after: number | null = 0;
  while (after !== null) {
    const page: Page = await get(`${pathOf(source)}/records?after=${after}&limit=${PAGE}`);
    for (const record of page.records) records.push(record);
    progress(records.length);
    after = page.next;
  }
  return records;
}

export async function loadReplay(
  source: Source,
  summary: RunSummary,
  progress: (count: number) => void,
): Promise<ReplayScene> {
  const [records, telemetry] = await Promise.all([
    loadRecords(source, progress),
    loadTelemetry(source),
  ]);
  return new ReplayScene(source.kind === "run" ? source.run : "", summary, records, telemetry);
}

/** A run can be looked at without its track: then it is said why there is none. */
async function loadTelemetry(source: Source): Promise<Telemetry> {
  if (source.kind === "rehearsal") {
    const samples = await get<TelemetrySample[]>(`${pathOf(source)}/telemetry`);
    return { samples, onlyNews: false, problem: null };
  }
  try {
    return await loadTrack(source.run);
  } catch (error) {
    return { ...NO_TELEMETRY, problem: error instanceof Error ? error.message : String(error) };
  }
}
