// Motion JPEG. Where the camera lets pages of other origins read it (CORS), each frame is seen to
// come; else the browser shows it, and does not say when frames come.
import { strings } from "../../strings";
import { Multipart } from "./multipart";
import { imageIn, type Listener, type Player } from "./player";

const text = strings.cameras;

export const playMjpeg: Player = (host, { url }, listener) => {
  const shown = imageIn(host);
  const leaving = new AbortController();
  let address = "";
  let loading = false;

  const show = (part: Uint8Array) => {
    if (loading) return; // the one before is not drawn yet
    const before = address;
    loading = true;
    address = URL.createObjectURL(new Blob([part as BlobPart], { type: "image/jpeg" }));
    const done = () => {
      loading = false;
      if (before) URL.revokeObjectURL(before);
    };
    shown.onload = () => {
      done();
      listener.frame();
    };
    shown.onerror = done;
    shown.src = address;
  };

  void read(url, leaving.signal, show)
    .then((reason) => reason && listener.failed(reason))
    .catch((error: unknown) => {
      if (leaving.signal.aborted) return;
      // Not reachable, or not for pages to read.
      if (error instanceof TypeError && !address) byItself(shown, url, listener);
      else listener.failed(text.ended);
    });
  return () => {
    leaving.abort();
    shown.onload = shown.onerror = null;
    shown.removeAttribute("src");
    if (address) URL.revokeObjectURL(address);
  };
};

/** Why it has ended. Throws a TypeError if it is not reachable, or may not be read. */
async function read(
  url: string,
  signal: AbortSignal,
  show: (part: Uint8Array) => void,
): Promise<string> {
  const answer = await fetch(url, {
    signal,
    mode: "cors",
    credentials: "omit",
    referrerPolicy: "no-referrer",
  });
  if (!answer.ok) {
    void answer.body?.cancel();
    return `${text.refused} ${answer.status}`;
  }
  const boundary = /boundary="?([^";]+)"?/i.exec(answer.headers.get("content-type") ?? "")?.[1];
  if (!boundary || !answer.body) {
    void answer.body?.cancel();
    return text.notMjpeg;
  }
  const parts = new Multipart(boundary);
  const reader = answer.body.getReader();
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return text.ended;
    const found = parts.push(value);
    if (found.length > 0) show(found.at(-1)!);
  }
}

function byItself(shown: HTMLImageElement, url: string, listener: Listener): void {
  shown.onload = () => listener.playing();
  shown.onerror = () => listener.failed(text.noPicture);
  shown.referrerPolicy = "no-referrer";
  shown.src = url;
}
