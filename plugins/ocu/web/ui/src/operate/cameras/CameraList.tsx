// What cameras see now, beside each other, or one of them large.
import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { age } from "../../shared/format";
import type { Fleet, Video } from "../../shared/types";
import { fill, strings } from "../../strings";
import { Stream, type StreamState } from "./stream";
import "./cameras.css";

const text = strings.cameras;

export default function CameraList({ payloads }: { payloads: Fleet["payloads"] }) {
  const large = useSignal("");
  const cameras = payloads.flatMap(({ id, video }) => (video ? [{ id, video }] : []));
  const isLarge = cameras.some(({ id }) => id === large.value);
  const shown = isLarge ? cameras.filter(({ id }) => id === large.value) : cameras;
  return (
    <ul class={isLarge ? "cameras cameras-large" : "cameras"}>
      {shown.map(({ id, video }) => (
        <Camera
          key={id}
          id={id}
          video={video}
          isLarge={isLarge}
          onEnlarge={() => (large.value = isLarge ? "" : id)}
        />
      ))}
    </ul>
  );
}

interface CameraProps {
  id: string;
  video: Video;
  isLarge: boolean;
  onEnlarge: () => void;
}

function Camera({ id, video, isLarge, onEnlarge }: CameraProps) {
  const host = useRef<HTMLDivElement>(null);
  const state = useSignal<StreamState>({ is: "connecting" });
  useEffect(() => {
    const stream = new Stream(host.current!, video);
    const stop = stream.state.subscribe((now) => (state.value = now));
    return () => {
      stop();
      stream.dispose();
    };
  }, [id, video]);
  const now = state.value;
  return (
    <li class={`camera camera-${now.is}`}>
      <header>
        <strong>{id}</strong>
        <span class="camera-state">{saidOf(now)}</span>
        <button type="button" class="plain" aria-pressed={isLarge} onClick={onEnlarge}>
          {text.large} <span class="for-readers">{id}</span>
        </button>
      </header>
      <div class="camera-picture">
        <div ref={host} class="camera-host" role="img" aria-label={fill(text.picture, { id })} />
        {now.is === "connecting" && <p>{text.connecting}</p>}
        {now.is === "failed" && (
          <p>
            {now.reason} <small>{fill(text.again, { seconds: now.again_s })}</small>
          </p>
        )}
      </div>
    </li>
  );
}

function saidOf(state: StreamState): string {
  switch (state.is) {
    case "connecting":
      return text.connecting;
    case "failed":
      return text.failed;
    case "old":
      return fill(text.old, { age: age(state.age_s) });
    case "playing":
      if (state.age_s === null) return text.ageless;
      return state.age_s < 2 ? text.live : fill(text.since, { age: age(state.age_s) });
  }
}
