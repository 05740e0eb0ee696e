// Which behaviors can be commanded to vehicles and payloads.
import type { Behavior, Fleet } from "../shared/types";

/** Those that have a button of their own, in this order; all are in the list. */
export const QUICK = ["goto", "takeoff", "land", "return_to_launch", "set_speed"] as const;

/** By vehicle and payload. A manned vehicle is never commanded. */
export function offersOf(fleet: Fleet, behaviors: readonly Behavior[]): Map<string, Behavior[]> {
  const manned = new Set(fleet.vehicles.filter((each) => each.manned).map(({ id }) => id));
  const offers = new Map<string, Behavior[]>();
  for (const behavior of behaviors) {
    if (behavior.type === "team") continue;
    for (const resource of behavior.resources) {
      if (manned.has(resource)) continue;
      const known = offers.get(resource);
      if (known) known.push(behavior);
      else offers.set(resource, [behavior]);
    }
  }
  return offers;
}

/** What all of them offer; its parameters are those of the first one's arbiter. */
export function inCommon(
  offers: ReadonlyMap<string, readonly Behavior[]>,
  resources: readonly string[],
): Behavior[] {
  const [first, ...others] = resources;
  if (first === undefined) return [];
  const names = others.map((each) => new Set(offers.get(each)?.map(({ name }) => name)));
  return (offers.get(first) ?? []).filter(({ name }) => names.every((known) => known.has(name)));
}

/** Whether a command can be given with these parameters: `groups` of which one has to be whole. */
export function isComplete(behavior: Behavior, values: Record<string, string>): boolean {
  const has = (name: string) => (values[name] ?? "").trim() !== "";
  const required = behavior.parameters.filter((each) => each.required);
  const groups = behavior.required_one_of;
  return (
    required.every(({ name }) => has(name)) &&
    (groups.length === 0 || groups.some((names) => names.every(has)))
  );
}
