// What a vehicle and its payloads do, and for whom.
import type { Command, Fleet } from "../../shared/types";
import { fill, strings } from "../../strings";

const text = strings.operate.vehicles;

export interface Work {
  behavior: string;
  command: Command;
}

/** Behaviors that hold a resource, oldest first. */
export function workOf(resource: string, commands: Record<string, Command>): Work[] {
  return Object.entries(commands)
    .filter(([, { resources }]) => resources.includes(resource))
    .map(([behavior, command]) => ({ behavior, command }))
    .sort((one, other) => one.command.since - other.command.since);
}

/** Of a run: a behavior ("r1.b3"), request (a), incident (i), or what it keeps between tasks (k). */
const OF_RUN = /^(r\d+)\.([abik])\d+$/;

/** Holders are operators, what runs have, or "" for none. */
export const isOperator = (holder: string): boolean => holder !== "" && !OF_RUN.test(holder);

/** The run that holds a resource; "": none does. */
export const runOf = (holder: string): string => OF_RUN.exec(holder)?.[1] ?? "";

/**
 * Which other run or operator has a resource, or for what a run has it that commands nothing now,
 * in words; "": none has.
 */
export function heldElsewhere(holder: string, run: string): string {
  if (isOperator(holder)) return fill(text.heldBy, { by: holder });
  const [, other, kind] = OF_RUN.exec(holder) ?? [];
  if (other && kind === "k") return fill(text.keptByRun, { run: other });
  if (other && kind === "i") return fill(text.heldForIncident, { incident: holder });
  return other && other !== run ? fill(text.heldByRun, { run: other }) : "";
}

export const payloadsOf = (fleet: Fleet, vehicle: string): string[] =>
  fleet.payloads.filter((payload) => payload.vehicle === vehicle).map(({ id }) => id);
