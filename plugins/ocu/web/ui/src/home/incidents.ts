// The incidents that are open, for the lists of runs: what stops which run, and what waits for that.
import { useEffect, useState } from "preact/hooks";
import { get } from "../shared/api";
import { alertChanges } from "../shared/executive";
import type { WaitingTask } from "../shared/types";
import { blockedBy, type IncidentLine } from "./blocking";

const WAITING_MS = 3000;

export interface Incidents {
  open: readonly IncidentLine[];
  /** The tasks that wait for what an incident holds, by the incident. */
  blocked: ReadonlyMap<string, readonly WaitingTask[]>;
}

const NONE: Incidents = { open: [], blocked: new Map() };

/** Read again whenever the alerts have changed, as each incident is one, and while one is open. */
export function useIncidents(): Incidents {
  const [incidents, setIncidents] = useState(NONE);
  useEffect(() => {
    let isOver = false;
    let timer: ReturnType<typeof setTimeout> | undefined;
    const read = async () => {
      clearTimeout(timer);
      let count = 0;
      try {
        const open = await get<IncidentLine[]>("/incidents");
        count = open.length;
        const waiting =
          count > 0 ? (await get<{ waiting: WaitingTask[] }>("/resources")).waiting : [];
        const blocked = new Map(open.map((each) => [each.incident, blockedBy(each, waiting)]));
        if (!isOver) setIncidents({ open, blocked });
      } catch {
        // The list of runs says that the executive does not answer.
      }
      if (!isOver && count > 0) timer = setTimeout(() => void read(), WAITING_MS);
    };
    const stop = alertChanges.subscribe(() => void read());
    return () => {
      isOver = true;
      clearTimeout(timer);
      stop();
    };
  }, []);
  return incidents;
}
