// What shows a camera's pictures, whatever brings them.
import type { Video } from "../../shared/types";

/** How a player says what becomes of it. */
export interface Listener {
  /** A picture is shown that was not there before. */
  frame(): void;
  /** It comes, but nobody can say when the last picture came. */
  playing(): void;
  /** It has ended, for this reason; what plays it is started again. */
  failed(reason: string): void;
}

/** Shows a video in `host`, until what is returned is called. */
export type Player = (host: HTMLElement, video: Video, listener: Listener) => () => void;

/** A `<video>` of its own, which says when frames come. */
export function videoIn(host: HTMLElement, listener: Listener): HTMLVideoElement {
  const element = document.createElement("video");
  element.muted = true;
  element.autoplay = true;
  element.playsInline = true;
  host.replaceChildren(element);
  const again = () => {
    if (!element.isConnected) return;
    listener.frame();
    element.requestVideoFrameCallback(again);
  };
  element.requestVideoFrameCallback(again);
  return element;
}

export function imageIn(host: HTMLElement): HTMLImageElement {
  const element = document.createElement("img");
  // What it shows nobody has described; the name of the camera is beside it.
  element.alt = "";
  host.replaceChildren(element);
  return element;
}
