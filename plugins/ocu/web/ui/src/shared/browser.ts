// What a live connection needs of the browser.
import { sessionKey } from "./key";
import type { Socket, Surroundings } from "./live";

/** A page in the background does not paint; messages are applied all the same. */
function paint(callback: () => void): void {
  if (document.hidden) queueMicrotask(callback);
  else {
    let done = false;
    const once = () => {
      if (done) return;
      done = true;
      removeEventListener("visibilitychange", once);
      callback();
    };
    addEventListener("visibilitychange", once);
    requestAnimationFrame(once);
  }
}

export const browser: Surroundings = {
  connect: () => {
    const scheme = location.protocol === "https:" ? "wss:" : "ws:";
    const address = `${scheme}//${location.host}/api/live`;
    // A script cannot set headers of a WebSocket, but it can offer subprotocols.
    const key = sessionKey();
    const protocols = key ? ["m2pem", `m2pem.key.${key}`] : ["m2pem"];
    return new WebSocket(address, protocols) as unknown as Socket;
  },
  paint,
  after: (callback, delay_ms) => {
    const timer = setTimeout(callback, delay_ms);
    return () => clearTimeout(timer);
  },
  every: (callback, ms) => {
    const timer = setInterval(callback, ms);
    return () => clearInterval(timer);
  },
  now_ms: () => performance.now(),
  chance: Math.random,
};
