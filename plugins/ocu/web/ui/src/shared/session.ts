// Who looks at this page, and what they may do.
import { signal } from "@preact/signals";
import { ApiError, get, post, remove } from "./api";
import { go, route } from "./router";
import type { Role, Session } from "./types";

/** undefined: not asked yet. null: nobody has signed in. */
export const session = signal<Session | null | undefined>(undefined);

const RANK: Record<Role, number> = { viewer: 0, operator: 1, commander: 2 };

export function may(role: Role): boolean {
  const now = session.value;
  return !!now && RANK[now.role] >= RANK[role];
}

/** Ask the server again. False: it did not answer. */
export async function loadSession(): Promise<boolean> {
  try {
    session.value = await get<Session>("/session");
    return true;
  } catch (error) {
    if (!(error instanceof ApiError)) return false;
    if (error.status !== 401 && error.status !== 403) return false;
    session.value = null;
    return true;
  }
}

export async function signIn(name: string, password: string): Promise<void> {
  await post("/session", { name, password });
  await loadSession();
}

export async function signOut(): Promise<void> {
  await remove("/session");
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
  go(`/sign-in?next=${encodeURIComponent(location.pathname + location.search)}`);
}
