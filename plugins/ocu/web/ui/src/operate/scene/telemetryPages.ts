// Where the vehicles of a run were, as far as the server has kept it.
import { get } from "../../shared/api";
import type { Telemetry, TelemetrySample } from "./telemetryTrack";

interface Page {
  samples: TelemetrySample[];
  next: number | null;
  problem: string | null;
}

const PAGE = 5000;

/** All of it, page by page. */
export async function loadTrack(run: string): Promise<Telemetry> {
  const path = `/runs/${encodeURIComponent(run)}/telemetry?limit=${PAGE}`;
  const samples: TelemetrySample[] = [];
  let page = await get<Page>(path);
  for (;;) {
    for (const sample of page.samples) samples.push(sample);
    if (page.next === null) return { samples, onlyNews: true, problem: page.problem };
    page = await get<Page>(`${path}&after=${page.next}`);
  }
}
