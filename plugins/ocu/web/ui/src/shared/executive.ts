// What every part of the page shows of the executive: runs, open prompts, and the fleet.
// Who wants all of one run listens to the messages themselves.
import { batch, computed, signal } from "@preact/signals";
import { browser } from "./browser";
import { LiveClient, type Connection } from "./live";
import { ServerClock } from "./serverClock";
import { loadSession, session, toSignIn } from "./session";
import { toast, toastFault } from "./Toasts";
import type {
  PayloadState,
  Prompt,
  RunSummary,
  ServerMessage,
  TeamState,
  VehicleState,
} from "./types";

export const connection = signal<Connection>("connecting");
export const runs = signal<RunSummary[]>([]);
export const prompts = signal<Prompt[]>([]);
export const holders = signal<Record<string, string>>({});
export const vehicles = signal<Record<string, VehicleState>>({});
export const payloads = signal<Record<string, PayloadState>>({});
export const teams = signal<Record<string, TeamState>>({});

/**
 * When the executive said anything last, in milliseconds since the Unix epoch; null: it is connected.
 * What is shown of vehicles was so then, and is not known now.
 */
export const unknownSince = signal<number | null>(null);
let receivedAt_ms = Date.now();

/** Known from the stream, while it is connected. */
export const serverClock = new ServerClock();

/** The states of a run that has ended. */
export const OVER: ReadonlySet<string> = new Set(["completed", "terminated", "failed", "stopped"]);

export const isOver = (run: RunSummary): boolean => OVER.has(run.status);

/** Runs that are driven now. */
export const activeRuns = computed(() =>
  runs.value.filter(({ status }) => status === "running" || status === "paused"),
);

const heardAt = new Map<string, number>();

/** Seconds since the last state of a vehicle or payload, by this browser's clock; null: never. */
export function silentFor_s(resource: string): number | null {
  const at = heardAt.get(resource);
  return at === undefined ? null : (performance.now() - at) / 1000;
}

type Listener = (message: ServerMessage) => void;
const listeners = new Set<Listener>();

/** Call `listener` with every message; the function that is returned ends it. */
export function listen(listener: Listener): () => void {
  listeners.add(listener);
  return () => void listeners.delete(listener);
}

const client = new LiveClient(browser, {
  received: (message) => {
    receivedAt_ms = Date.now();
    if ("now" in message) serverClock.heard(message.now);
    batch(() => {
      take(message);
      for (const listener of listeners) listener(message);
    });
  },
  connection: (state) => {
    batch(() => {
      connection.value = state;
      if (state === "open") unknownSince.value = null;
      else if (state === "lost") unknownSince.value ??= receivedAt_ms;
    });
    if (state !== "lost") serverClock.forget();
    if (state === "lost") void afterLoss();
    if (state === "refused") signedOut();
  },
});

/** Rises when the alerts are to be read again. */
export const alertChanges = signal(0);

/** Seconds of the executive's clock in a real second. */
export const speed = signal(1);

/** Rises when it is to be read again who is present, and who asks whom. */
export const operatorChanges = signal(0);

/** Of which mission the comments are to be read again; "": of all. */
export const commentChanges = signal<{ mission: string }>({ mission: "" });

/** Rises when the schedule is to be read again. */
export const scheduleChanges = signal(0);

/** Rises when shared space is to be read again. */
export const spaceChanges = signal(0);

export const connect = (): void => client.start();
export const disconnect = (): void => client.stop();
export const watch = (run: string | null): void => client.watch(run);
export const edit = (mission: string | null): void => client.edit(mission);

/**
 * A page that is not signed in is refused before it is connected, which a browser does not tell.
 */
async function afterLoss(): Promise<void> {
  if ((await loadSession()) && session.value === null) signedOut();
}

function signedOut(): void {
  client.stop();
  session.value = null;
  toSignIn();
}

function take(message: ServerMessage): void {
  switch (message.type) {
    case "snapshot":
      alertChanges.value += 1;
      operatorChanges.value += 1;
      commentChanges.value = { mission: "" };
      scheduleChanges.value += 1;
      spaceChanges.value += 1;
      speed.value = message.speed;
      runs.value = message.runs;
      prompts.value = message.prompts;
      holders.value = message.holders;
      teams.value = message.teams;
      heardBefore(message.vehicles);
      heardBefore(message.payloads);
      vehicles.value = message.vehicles;
      payloads.value = message.payloads;
      break;
    case "frame":
      if (message.runs) message.runs.forEach(takeRun);
      if (message.holders) holders.value = { ...holders.value, ...message.holders };
      if (message.teams) teams.value = { ...teams.value, ...message.teams };
      if (message.vehicles) {
        heardNow(message.vehicles);
        vehicles.value = { ...vehicles.value, ...message.vehicles };
      }
      if (message.payloads) {
        heardNow(message.payloads);
        payloads.value = { ...payloads.value, ...message.payloads };
      }
      break;
    case "prompt": {
      const { run, prompt } = message.prompt;
      prompts.value = [...without(run, prompt), message.prompt];
      break;
    }
    case "prompt_closed":
      prompts.value = without(message.run, message.prompt);
      break;
    case "run":
      takeRun(message.run);
      break;
    case "fault":
      toastFault(message.text);
      break;
    case "notice":
      toast(message.text);
      break;
    case "alerts":
      alertChanges.value += 1;
      break;
    case "operators":
      operatorChanges.value += 1;
      break;
    case "comments":
      commentChanges.value = { mission: message.mission };
      break;
    case "schedule":
      scheduleChanges.value += 1;
      break;
    case "shared_space":
      spaceChanges.value += 1;
      break;
    case "alive":
    case "log":
      break;
  }
}

const without = (run: string, prompt: string): Prompt[] =>
  prompts.value.filter((other) => other.run !== run || other.prompt !== prompt);

function takeRun(summary: RunSummary): void {
  const known = runs.value.some(({ run }) => run === summary.run);
  runs.value = known
    ? runs.value.map((other) => (other.run === summary.run ? summary : other))
    : [...runs.value, summary];
  if (isOver(summary)) prompts.value = prompts.value.filter(({ run }) => run !== summary.run);
}

/** The state of what is lost comes from the executive, and not from the resource. */
function heardNow(states: Record<string, { link?: string }>): void {
  const now = performance.now();
  for (const [resource, { link }] of Object.entries(states)) {
    if (link !== "lost") heardAt.set(resource, now);
  }
}

/** Of a snapshot the clocks are the server's: old is what is older than the newest. */
function heardBefore(states: Record<string, { time_us: number }>): void {
  const newest_us = Math.max(0, ...Object.values(states).map(({ time_us }) => time_us));
  const now = performance.now();
  for (const [resource, { time_us }] of Object.entries(states)) {
    heardAt.set(resource, now - (newest_us - time_us) / 1000);
  }
}
