// Commands to the executive: they say when they were given, and are refused if they arrive late.
import { strings } from "../strings";
import { ApiError, post, put, UnreachableError, type Options } from "./api";
import { connection, serverClock } from "./executive";
import { toast } from "./Toasts";

const text = strings.shell;

const ANSWER_MS = 5000;
/** A start checks the mission first. */
const START_MS = 30_000;

/** For a command that is given now. */
export function givenNow(): Record<string, string> {
  const now = serverClock.now();
  return now === null ? {} : { "M2pem-Given": now.toFixed(3) };
}

async function give<T>(limit_ms: number, send: (options: Options) => Promise<T>): Promise<T> {
  if (connection.value !== "open") throw new UnreachableError(text.notSent);
  try {
    return await send({ limit_ms, headers: givenNow() });
  } catch (error) {
    throw error instanceof ApiError ? error : new UnreachableError(text.notConfirmed);
  }
}

/** Ask for something to be started. */
export const start = <T>(path: string, body: unknown): Promise<T> =>
  give(START_MS, (options) => post<T>(path, body, options));

/** Give a command that may be refused for a reason that the page asks about. */
export const order = <T>(path: string, body: unknown): Promise<T> =>
  give(ANSWER_MS, (options) => post<T>(path, body, options));

/** Put something in place of what is there. */
export const replace = (path: string, body: unknown): Promise<unknown> =>
  give(ANSWER_MS, (options) => put(path, body, options));

/** Give a command; false: it was not carried out, which is said. `body`: of a PUT, if `replaces`. */
export async function command(path: string, body?: unknown, replaces = false): Promise<boolean> {
  try {
    await give(ANSWER_MS, (options) => (replaces ? put : post)(path, body ?? {}, options));
    return true;
  } catch (error) {
    toast(error instanceof Error ? error.message : String(error), "bad");
    return false;
  }
}
