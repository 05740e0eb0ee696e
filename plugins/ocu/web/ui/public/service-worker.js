// Keeps the page's own files, so that it opens without a network and says so. It answers nothing else:
// what the executive says and is asked goes to it, or fails.
importScripts("/shell-files.js"); // made when the page is built

const CACHE = `m2pem-${self.SHELL.version}`;

self.addEventListener("install", (event) => {
  event.waitUntil(caches.open(CACHE).then((cache) => cache.addAll(self.SHELL.files)));
});

self.addEventListener("activate", (event) => {
  event.waitUntil(
    caches
      .keys()
      .then((names) => names.filter((name) => name.startsWith("m2pem-") && name !== CACHE))
      .then((old) => Promise.all(old.map((name) => caches.delete(name)))),
  );
});

self.addEventListener("fetch", (event) => {
  const { request } = event;
  const { origin, pathname } = new URL(request.url);
  if (request.method !== "GET" || origin !== location.origin) return;
  if (request.mode === "navigate") event.respondWith(page(request));
  else if (pathname.startsWith("/assets/")) event.respondWith(asset(request));
});

/** As the executive has it; else the one that was kept. */
async function page(request) {
  try {
    const answer = await fetch(request);
    // A proxy answers for an executive that does not.
    if (answer.status !== 502 && answer.status !== 504) return answer;
  } catch {
    // No network, or no executive.
  }
  const cache = await caches.open(CACHE);
  return (await cache.match("/")) ?? Response.error();
}

/** Its name has a hash of its content: what was kept is what the executive has. */
async function asset(request) {
  const cache = await caches.open(CACHE);
  const kept = await cache.match(request);
  if (kept) return kept;
  const answer = await fetch(request);
  if (answer.ok) await cache.put(request, answer.clone());
  return answer;
}
