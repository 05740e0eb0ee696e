// Requests to the server. What it refuses is an ApiError, with what it said (RFC 9457).
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

async function request<T>(method: string, path: string, body?: unknown): Promise<T> {
  const init: RequestInit = { method, credentials: "same-origin" };
  if (body !== undefined) {
    init.headers = { "Content-Type": "application/json" };
    init.body = JSON.stringify(body);
  }
  const response = await fetch(`/api${path}`, init);
  if (response.ok) return (response.status === 204 ? undefined : await response.json()) as T;
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

export const get = <T>(path: string): Promise<T> => request("GET", path);
export const post = <T>(path: string, body: unknown = {}): Promise<T> =>
  request("POST", path, body);
export const put = <T>(path: string, body: unknown): Promise<T> => request("PUT", path, body);
export const remove = <T>(path: string): Promise<T> => request("DELETE", path);
