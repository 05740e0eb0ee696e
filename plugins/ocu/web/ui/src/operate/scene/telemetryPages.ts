// Where the vehicles of a run were, as far as the server has kept it.
import { get } from "../../shared/api";
import type { Telemetry, TelemetrySample } from "./telemetryTrack";

interface Page {
  samples: TelemetrySample[];
  next: number | null;
  problem: string | null;
}

const PAGE = 5000;

/** All of it after a mission time, page by page. */
export async function loadTrack(run: string, after_s: number | null = null): Promise<Telemetry> {
  const path = `/runs/${encodeURIComponent(run)}/telemetry?limit=${PAGE}`;
  const samples: TelemetrySample[] = [];
  let page = await get<Page>(after_s === null ? path : `${path}&after=${after_s}`);
  for (;;) {
    for (const sample of page.samples) samples.push(sample);
    if (page.next === null) return { samples, onlyNews: true, problem: page.problem };
    page = await get<Page>(`${path}&after=${page.next}`);
  }
}
