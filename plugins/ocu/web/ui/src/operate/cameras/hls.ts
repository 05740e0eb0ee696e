// HTTP Live Streaming (RFC 8216) by hls.js, near its live edge.
import type Hls from "hls.js";
import { strings } from "../../strings";
import { videoIn, type Player } from "./player";

const text = strings.cameras;

export const playHls: Player = (host, { url }, listener) => {
  const element = videoIn(host, listener);
  let hls: Hls | undefined;
  let left = false;
  const begin = async () => {
    const { default: Made } = await import("hls.js/light");
    if (left) return;
    if (!Made.isSupported()) {
      listener.failed(text.noHls);
      return;
    }
    hls = new Made({
      // A worker would be a script of a blob, which the page's policy forbids.
      enableWorker: false,
      lowLatencyMode: true,
      liveDurationInfinity: true,
      backBufferLength: 10,
    });
    hls.on(Made.Events.ERROR, (_, { fatal, details, response }) => {
      if (!fatal) return;
      const code = response?.code;
      listener.failed(code ? `${text.refused} ${code}` : `${text.noStream} (${details})`);
    });
    hls.loadSource(url);
    hls.attachMedia(element);
  };
  void begin();
  return () => {
    left = true;
    hls?.destroy();
  };
};
