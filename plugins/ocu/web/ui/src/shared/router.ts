// Which page is shown: the path of the address, and nothing else.
import { signal } from "@preact/signals";

export type Route =
  | { page: "home" }
  | { page: "signIn" }
  | { page: "alerts" }
  | { page: "fleet" }
  | { page: "editor"; mission: string }
  | { page: "run"; run: string }
  | { page: "rehearsal"; id: string }
  | { page: "nothing" };

export function routeOf(path: string): Route {
  const [first = "", second, ...more] = path
    .split("/")
    .filter((part) => part !== "")
    .map(decodeURIComponent);
  if (more.length > 0) return { page: "nothing" };
  if (second === undefined) {
    if (first === "") return { page: "home" };
    if (first === "alerts") return { page: "alerts" };
    if (first === "sign-in") return { page: "signIn" };
    return first === "fleet" ? { page: "fleet" } : { page: "nothing" };
  }
  switch (first) {
    case "missions":
      return { page: "editor", mission: second };
    case "runs":
      return { page: "run", run: second };
    case "rehearsals":
      return { page: "rehearsal", id: second };
    default:
      return { page: "nothing" };
  }
}

export const route = signal<Route>(routeOf(location.pathname));

type Guard = () => boolean;
let guard: Guard = () => true;

/** What must agree before another page is shown: an editor with changes that are not saved. */
export function guardLeaving(mayLeave: Guard): () => void {
  guard = mayLeave;
  return () => {
    guard = () => true;
  };
}

export function go(path: string): void {
  if (!guard()) return;
  history.pushState(null, "", path);
  show();
}

/** Go to a path; the one before is forgotten. */
export function replace(path: string): void {
  history.replaceState(null, "", path);
  show();
}

/** The address of what is shown: the browser's is another one while it goes back. */
let shown = location.href;

function show(): void {
  shown = location.href;
  route.value = routeOf(location.pathname);
}

addEventListener("popstate", () => {
  if (guard()) show();
  else history.pushState(null, "", shown);
});
