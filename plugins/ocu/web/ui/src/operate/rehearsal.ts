// A rehearsal is shown when it has been computed.
import { get } from "../shared/api";
import type { Finding, RunSummary } from "../shared/types";

interface Rehearsal {
  state: "running" | "done" | "failed" | "cancelled";
  summary?: RunSummary | null;
  problem?: string | null;
  findings?: Finding[];
}

const ASKED_EVERY_MS = 300;

/** Throws what went wrong with it, as a text for people. */
export async function waitForRehearsal(id: string): Promise<RunSummary> {
  for (;;) {
    const {
      state,
      summary,
      problem,
      findings = [],
    } = await get<Rehearsal>(`/rehearsals/${encodeURIComponent(id)}`);
    if (summary && state === "done") return summary;
    if (state !== "running") {
      const said = [problem ?? "", ...findings.map(({ message }) => message)];
      throw new Error(said.filter(Boolean).join("\n") || state);
    }
    await new Promise((resolve) => setTimeout(resolve, ASKED_EVERY_MS));
  }
}
