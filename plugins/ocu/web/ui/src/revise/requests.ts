// What the server is asked about a revision.
import { post } from "../shared/api";
import { givenNow } from "../shared/command";
import type { Moves, NewVersion, Plan } from "./plan";

/** The new version is checked, and what follows it is explored. */
const LIMIT_MS = 120_000;

function bodyOf(wanted: NewVersion, moves: Moves) {
  switch (wanted.kind) {
    case "file":
      return { mission: wanted.mission, xml: wanted.xml, moves };
    case "had":
      return { had: wanted.version, moves };
    case "mission":
      return { mission: wanted.mission, version: wanted.version || null, moves };
  }
}

const pathOf = (run: string) => `/runs/${encodeURIComponent(run)}/revision`;

export const planOf = (run: string, wanted: NewVersion, moves: Moves): Promise<Plan> =>
  post<Plan>(`${pathOf(run)}/plan`, bodyOf(wanted, moves), { limit_ms: LIMIT_MS });

export const revise = (
  run: string,
  wanted: NewVersion,
  moves: Moves,
  plan: string,
  evenIfStuck: boolean,
): Promise<void> =>
  post(
    pathOf(run),
    { ...bodyOf(wanted, moves), plan, even_if_stuck: evenIfStuck },
    { limit_ms: LIMIT_MS, headers: givenNow() },
  );
