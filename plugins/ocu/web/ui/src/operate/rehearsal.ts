// A rehearsal is shown when it has been computed.
import { get } from "../shared/api";
import type { RunSummary } from "../shared/types";

interface Rehearsal {
  state: "running" | "done" | "failed" | "cancelled";
  summary?: RunSummary | null;
  problem?: { detail?: string; title?: string } | string | null;
}

const ASKED_EVERY_MS = 300;

/** Throws what went wrong with it, as a text for people. */
export async function waitForRehearsal(id: string): Promise<RunSummary> {
  for (;;) {
    const { state, summary, problem } = await get<Rehearsal>(
      `/rehearsals/${encodeURIComponent(id)}`,
    );
    if (summary && state === "done") return summary;
    if (state !== "running") {
      const said = typeof problem === "string" ? problem : (problem?.detail ?? problem?.title);
      throw new Error(said ?? state);
    }
    await new Promise((resolve) => setTimeout(resolve, ASKED_EVERY_MS));
  }
}
