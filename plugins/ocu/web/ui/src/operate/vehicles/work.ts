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

/** Holders are operators, behaviors ("r1.b3"), requests ("r1.a2"), or "" for none. */
export const isOperator = (holder: string): boolean =>
  holder !== "" && !/^r\d+\.[ab]\d+$/.test(holder);

/** The run whose behavior or request holds a resource; "": none does. */
export const runOf = (holder: string): string => /^(r\d+)\.[ab]\d+$/.exec(holder)?.[1] ?? "";

/** Which other run or operator has a resource, in words; "": none has. */
export function heldElsewhere(holder: string, run: string): string {
  if (isOperator(holder)) return fill(text.heldBy, { by: holder });
  const other = runOf(holder);
  return other && other !== run ? fill(text.heldByRun, { run: other }) : "";
}

export const payloadsOf = (fleet: Fleet, vehicle: string): string[] =>
  fleet.payloads.filter((payload) => payload.vehicle === vehicle).map(({ id }) => id);
