// Has the browser keep the page's own files (public/service-worker.js), where it allows that: with TLS, and
// on the executive's own machine.
export function keepShell(): void {
  if (!import.meta.env.PROD || !("serviceWorker" in navigator)) return;
  // The page goes on without it, as it does in a private window.
  navigator.serviceWorker.register("/service-worker.js").catch(() => undefined);
}
