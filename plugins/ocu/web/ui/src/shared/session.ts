// Who looks at this page, and what they may do.
import { signal } from "@preact/signals";
import { ApiError, get, post, remove } from "./api";
import { keepKey } from "./key";
import { go, replace, route } from "./router";
import type { BegunSession, Role, Session } from "./types";

/** undefined: not asked yet. null: no user has signed in. */
export const session = signal<Session | null | undefined>(undefined);

const RANK: Record<Role, number> = { viewer: 0, operator: 1, commander: 2 };

export function may(role: Role): boolean {
  const now = session.value;
  return !!now && RANK[now.role] >= RANK[role];
}

/** Why one must sign in again: the address was used, there were too many attempts, no key. */
export type Refused = "token" | "attempts" | "key";
let refused: Refused | null = null;

/** Ask the server again. False: it did not answer. */
export async function loadSession(): Promise<boolean> {
  try {
    session.value = await get<Session>("/session");
    return true;
  } catch (error) {
    if (!(error instanceof ApiError)) return false;
    if (error.status !== 401 && error.status !== 403) return false;
    refused = error.problem.missing === "M2pem-Key" ? "key" : null;
    session.value = null;
    return true;
  }
}

export const signIn = (name: string, password: string): Promise<void> => begin({ name, password });

async function begin(wanted: object): Promise<void> {
  const { key, ...begun } = await post<BegunSession>("/session", wanted);
  keepKey(key);
  session.value = begun;
}

/** Take the token out of the address: it must be neither seen nor kept. "": there is none. */
export function takeToken(): string {
  const query = new URLSearchParams(location.search);
  const token = query.get("token") ?? "";
  if (query.has("token")) {
    query.delete("token");
    const rest = String(query);
    replace(location.pathname + (rest && `?${rest}`) + location.hash);
  }
  return token;
}

/** Sign in with a token. False: the server did not answer. */
export async function redeem(token: string): Promise<boolean> {
  try {
    await begin({ token });
  } catch (error) {
    if (!(error instanceof ApiError)) return false;
    if (!(await loadSession())) return false;
    refused = error.status === 429 ? "attempts" : "token";
  }
  return true;
}

export async function signOut(): Promise<void> {
  await remove("/session");
  keepKey("");
  session.value = null;
  go("/sign-in");
}

/** Where to go after signing in: a path of this page, never another site. */
export function nextPath(search: string): string {
  const next = new URLSearchParams(search).get("next") ?? "/";
  return /^\/(?![/\\])/.test(next) ? next : "/";
}

export function toSignIn(): void {
  if (route.value.page === "signIn") return;
  const query = new URLSearchParams({ next: location.pathname + location.search });
  if (refused) query.set("refused", refused);
  go(`/sign-in?${query}`);
}
