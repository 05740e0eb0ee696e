// One picture after another, each fetched when the one before is there.
import { strings } from "../../strings";
import { imageIn, type Player } from "./player";

const WITHIN_MS = 10_000;

export const playImages: Player = (host, { url, every_s }, listener) => {
  const shown = imageIn(host);
  let timer: ReturnType<typeof setTimeout> | undefined;
  let left = false;

  const fetchNext = () => {
    const next = new Image();
    next.referrerPolicy = "no-referrer";
    const begun_ms = performance.now();
    timer = setTimeout(() => fail(), WITHIN_MS);
    const fail = () => {
      clearTimeout(timer);
      next.onload = next.onerror = null;
      if (!left) listener.failed(strings.cameras.noPicture);
    };
    next.onload = () => {
      clearTimeout(timer);
      if (left) return;
      shown.src = next.src;
      listener.frame();
      const wait_ms = Math.max(0, every_s * 1000 - (performance.now() - begun_ms));
      timer = setTimeout(fetchNext, wait_ms);
    };
    next.onerror = fail;
    next.src = withStamp(url);
  };
  fetchNext();
  return () => {
    left = true;
    clearTimeout(timer);
  };
};

/** No cache answers for the camera. */
function withStamp(url: string): string {
  return `${url}${url.includes("?") ? "&" : "?"}m2pem=${Date.now()}`;
}
