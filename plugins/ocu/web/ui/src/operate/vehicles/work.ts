// What a vehicle and its payloads do, and for whom.
import type { Command, Fleet, WaitingTask } from "../../shared/types";
import { fill, strings } from "../../strings";

const text = strings.operate.vehicles;

/** The first in the order of service; the others are counted. */
const NAMED_WAITERS = 2;

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
 * in words; "": none has. `labels`: the task and run of a holder, "DRIVE of r1".
 */
export function heldElsewhere(
  resource: string,
  holder: string,
  run: string,
  labels: Readonly<Record<string, string>>,
): string {
  if (isOperator(holder)) return fill(text.heldBy, { by: holder });
  const [, other, kind] = OF_RUN.exec(holder) ?? [];
  if (other && kind === "k") return fill(text.keptByRun, { run: other });
  if (other && kind === "i") return fill(text.heldForIncident, { incident: holder });
  if (!other || other === run) return "";
  const task = (labels[holder] ?? "").replace(new RegExp(` of ${other}$`), "");
  const said = resource.includes("/") ? text.payloadOfRun : text.vehicleOfRun;
  return fill(said, { task: [other, task].filter(Boolean).join(", ") });
}

/** Which tasks wait for a vehicle or payload, in words; "": none does. */
export function waitersOf(resource: string, waiting: readonly WaitingTask[]): string {
  const found = waiting.filter(({ holders }) => resource in holders);
  const named = found.slice(0, NAMED_WAITERS).map(({ run, task }) => `${run}, ${task}`);
  if (found.length > NAMED_WAITERS) {
    named.push(fill(text.moreWait, { count: found.length - NAMED_WAITERS }));
  }
  return named.length === 0 ? "" : fill(text.waitedFor, { tasks: named.join("; ") });
}

export const payloadsOf = (fleet: Fleet, vehicle: string): string[] =>
  fleet.payloads.filter((payload) => payload.vehicle === vehicle).map(({ id }) => id);
