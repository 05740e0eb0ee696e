// Requests to the server. What it refuses is an ApiError, with what it said (RFC 9457).
import { sessionKey } from "./key";
import type { Finding } from "./types";

export interface Problem {
  type: string;
  title: string;
  status: number;
  detail: string;
  findings?: Finding[];
  [more: string]: unknown;
}

export class ApiError extends Error {
  constructor(readonly problem: Problem) {
    super(problem.detail || problem.title);
  }

  get status(): number {
    return this.problem.status;
  }
}

/** The server did not answer in time, or could not be reached. */
export class UnreachableError extends Error {}

/** How long an answer may take; what a request says beside its body. */
export interface Options {
  limit_ms?: number;
  headers?: Record<string, string>;
}

const LIMIT_MS = 30_000;

async function request<T>(
  method: string,
  path: string,
  body?: unknown,
  { limit_ms = LIMIT_MS, headers = {} }: Options = {},
): Promise<T> {
  try {
    const signal = AbortSignal.timeout(limit_ms);
    return await ask<T>(path, body, { method, credentials: "same-origin", headers, signal });
  } catch (error) {
    if (error instanceof ApiError) throw error;
    throw new UnreachableError(error instanceof Error ? error.message : String(error));
  }
}

async function ask<T>(path: string, body: unknown, init: RequestInit): Promise<T> {
  const response = await answered(path, body, init);
  return (response.status === 204 ? undefined : await response.json()) as T;
}

async function answered(path: string, body: unknown, init: RequestInit): Promise<Response> {
  if (body instanceof Blob) {
    init.headers = { ...init.headers, "Content-Type": "application/octet-stream" };
    init.body = body;
  } else if (body !== undefined) {
    init.headers = { ...init.headers, "Content-Type": "application/json" };
    init.body = JSON.stringify(body);
  }
  const key = sessionKey();
  if (key) init.headers = { ...init.headers, "M2pem-Key": key };
  const response = await fetch(`/api${path}`, init);
  if (response.ok) return response;
  throw new ApiError(await problemOf(response));
}

async function problemOf(response: Response): Promise<Problem> {
  try {
    return (await response.json()) as Problem;
  } catch {
    const { status, statusText } = response;
    return { type: "about:blank", title: statusText, status, detail: "" };
  }
}

/** The bytes of a file. */
export async function getFile(path: string): Promise<Blob> {
  return (await answered(path, undefined, { method: "GET", credentials: "same-origin" })).blob();
}
export const get = <T>(path: string): Promise<T> => request("GET", path);
export const post = <T>(path: string, body: unknown = {}, options?: Options): Promise<T> =>
  request("POST", path, body, options);
/** The bytes of a file that comes in answer. */
export async function postForFile(path: string, body: unknown): Promise<Blob> {
  const init: RequestInit = { method: "POST", credentials: "same-origin" };
  return (await answered(path, body, init)).blob();
}
export const put = <T>(path: string, body: unknown, options?: Options): Promise<T> =>
  request("PUT", path, body, options);
export const remove = <T>(path: string): Promise<T> => request("DELETE", path);
