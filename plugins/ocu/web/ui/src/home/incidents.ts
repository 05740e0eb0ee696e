// The incidents that are open, for the lists of runs: what stops which run.
import { useEffect, useState } from "preact/hooks";
import { get } from "../shared/api";
import { alertChanges } from "../shared/executive";

export interface IncidentLine {
  run: string;
  incident: string;
  task: string;
  code: string;
  reason: string;
  resources: string[];
}

/** Read again whenever the alerts have changed: each incident is one. */
export function useIncidents(): readonly IncidentLine[] {
  const [incidents, setIncidents] = useState<readonly IncidentLine[]>([]);
  useEffect(() => {
    const read = async () => {
      try {
        setIncidents(await get<IncidentLine[]>("/incidents"));
      } catch {
        // The list of runs says that the executive does not answer.
      }
    };
    return alertChanges.subscribe(() => void read());
  }, []);
  return incidents;
}
