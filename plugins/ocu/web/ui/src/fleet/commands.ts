// Commands to vehicles and payloads outside of missions. What one would end is said before it is
// given; what was refused is said for each vehicle.
import { signal } from "@preact/signals";
import { start } from "../shared/command";
import { toast } from "../shared/Toasts";
import { counted, fill, strings } from "../strings";
import { readStatus, status } from "./state";

const text = strings.fleet.commands;

/** Vehicles of one request: it is answered in time, and the next says how far it is. */
const AT_ONCE = 25;

export type Verb = "take" | "give-back" | "request" | "hold" | "resume" | "execute";

export interface Order {
  verb: Verb;
  resources: readonly string[];
  /** Of `execute`, with its name for people. */
  behavior?: { name: string; title: string; parameters: Record<string, string> };
}

export interface Effect {
  resource: string;
  take: boolean;
  says: string[];
  problem: string;
}

export interface Result {
  resource: string;
  run: string;
  problem: string;
}

/** An order that has to be confirmed; `effects` null: what it ends is being asked. */
export const asked = signal<{ order: Order; effects: readonly Effect[] | null } | null>(null);
/** How much of an order that is being sent is done. */
export const sending = signal<{ done: number; count: number } | null>(null);
/** What was refused of the last order. */
export const refused = signal<readonly Result[]>([]);

/** Which order was carried out last, for all whom it was given to. */
export const accepted = signal<Order | null>(null);

/** One name, or how many. */
export function namesOf(resources: readonly string[]): string {
  if (resources.length === 1) return resources[0]!;
  const payloads = resources.filter((each) => each.includes("/")).length;
  const { vehicles, payloads: only, both } = text.names;
  const names = payloads === 0 ? vehicles : payloads === resources.length ? only : both;
  return fill(names, { count: resources.length });
}

/** Give an order; first ask about one that concerns many, or ends something. */
export async function order(wanted: Order): Promise<void> {
  if (wanted.resources.length === 0 || sending.value) return;
  const isOne = wanted.resources.length === 1;
  refused.value = [];
  if (!isOne) asked.value = { order: wanted, effects: null };
  const effects = await effectsOf(wanted);
  const stillAsked = isOne || asked.value?.order === wanted;
  if (!effects || !stillAsked) {
    if (stillAsked) asked.value = null;
    return;
  }
  const [first] = effects;
  if (isOne && first && first.says.length === 0 && !first.take) await send(wanted, false);
  else asked.value = { order: wanted, effects };
}

/** null: that could not be asked, which is said. */
async function effectsOf({ verb, resources }: Order): Promise<readonly Effect[] | null> {
  const none = (resource: string): Effect => ({ resource, take: false, says: [], problem: "" });
  // What was commanded outside of a mission is held as it is, and goes on later.
  const endsNothing = (resource: string) =>
    verb === "give-back" ||
    verb === "request" ||
    verb === "resume" ||
    (verb === "hold" && status.peek()[resource]?.direct === true);
  const questioned = resources.filter((resource) => !endsNothing(resource));
  if (questioned.length === 0) return resources.map(none);
  try {
    const found = await start<{ effects: Effect[] }>("/fleet/preview", { resources: questioned });
    const byName = new Map(found.effects.map((effect) => [effect.resource, effect]));
    return resources.map((resource) => byName.get(resource) ?? none(resource));
  } catch (error) {
    toast(error instanceof Error ? error.message : String(error), "bad");
    return null;
  }
}

/** `take`: that those that have to be taken over are taken was confirmed. */
export async function send(wanted: Order, take: boolean): Promise<void> {
  const { verb, resources, behavior } = wanted;
  asked.value = null;
  const results: Result[] = [];
  for (let from = 0; from < resources.length; from += AT_ONCE) {
    sending.value = { done: from, count: resources.length };
    const some = resources.slice(from, from + AT_ONCE);
    const body = {
      resources: some,
      ...(verb === "execute"
        ? { behavior: behavior!.name, parameters: behavior!.parameters, take }
        : {}),
      ...(verb === "hold" ? { take } : {}),
    };
    try {
      results.push(...(await start<{ results: Result[] }>(`/fleet/${verb}`, body)).results);
    } catch (error) {
      const why = error instanceof Error ? error.message : String(error);
      results.push(...some.map((resource) => ({ resource, run: "", problem: why })));
      const rest = resources.slice(from + AT_ONCE);
      results.push(...rest.map((resource) => ({ resource, run: "", problem: text.notSent })));
      break;
    }
  }
  sending.value = null;
  say(wanted, results);
  void readStatus();
}

function say(wanted: Order, results: readonly Result[]): void {
  const { verb, behavior } = wanted;
  const done = results.filter(({ problem }) => !problem).map(({ resource }) => resource);
  refused.value = results.filter(({ problem }) => problem);
  if (done.length > 0) {
    const names = namesOf(done);
    toast(fill(text.done[verb], { names, behavior: behavior?.title ?? "" }), "good");
  }
  const [first] = refused.value;
  if (!first) {
    accepted.value = wanted;
    return;
  }
  toast(
    refused.value.length === 1
      ? `${first.resource}: ${first.problem}`
      : counted(text.refusals, refused.value.length),
    "bad",
  );
}
