// What an incident blocks: vehicles and payloads that are held for it, and the tasks that wait for them.
import type { WaitingTask } from "../shared/types";
import { fill, strings } from "../strings";

const words = strings.runs;

export interface IncidentLine {
  run: string;
  incident: string;
  task: string;
  code: string;
  reason: string;
  resources: string[];
}

/** The tasks of any run that wait for what an incident holds, in the order of service. */
export function blockedBy(
  { incident, resources }: Pick<IncidentLine, "incident" | "resources">,
  waiting: readonly WaitingTask[],
): WaitingTask[] {
  return waiting.filter(({ holders }) =>
    Object.entries(holders).some(
      ([resource, holder]) => holder === incident && resources.includes(resource),
    ),
  );
}

/** In words; "": it holds nothing. */
export function heldFor(
  { resources }: Pick<IncidentLine, "resources">,
  blocked: readonly WaitingTask[],
): string {
  if (resources.length === 0) return "";
  const held = fill(words.holds, { resources: resources.join(", ") });
  const tasks = blocked.map(({ run, task }) => `${run}, ${task}`).join("; ");
  return tasks ? `${held}; ${fill(words.blocks, { tasks })}` : held;
}
