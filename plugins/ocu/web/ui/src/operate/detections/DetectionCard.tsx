// One detection: what, by which payload, when and where, and what a camera saw then.
import { useEffect, useRef, useState } from "preact/hooks";
import { clock } from "../../shared/format";
import { fill, strings } from "../../strings";
import { useOperating } from "../context";
import { DetectionPicture } from "./DetectionPicture";
import { positionOf } from "./position";
import "./detections.css";

const text = strings.operate.detections;

/** `onLayout`: it is on the page, or has another size. */
export default function DetectionCard({ onLayout }: { onLayout?: (card: HTMLElement) => void }) {
  const { scene, detection } = useOperating();
  const found = scene.detections.value.all.find(({ number }) => number === detection.value);
  const card = useRef<HTMLElement>(null);
  const close = useRef<HTMLButtonElement>(null);
  const before = useRef<Element | null>(null);
  const [large, enlarge] = useState(false);
  const leave = () => {
    detection.value = null;
    if (before.current instanceof HTMLElement) before.current.focus();
  };
  useEffect(() => {
    before.current = document.activeElement;
    close.current?.focus();
  }, [found?.number]);
  useEffect(() => {
    const shown = card.current;
    if (!shown || !onLayout) return;
    const observer = new ResizeObserver(() => onLayout(shown));
    observer.observe(shown);
    return () => observer.disconnect();
  }, [found?.number]);
  if (!found) return null;
  return (
    <section
      ref={card}
      class={large ? "detection-card detection-card-large" : "detection-card"}
      aria-label={fill(text.card, { type: found.type, source: found.source })}
      onKeyDown={(event) => {
        if (event.key !== "Escape" || event.shiftKey) return;
        event.stopPropagation();
        leave();
      }}
    >
      <header>
        <strong>
          <i class="detection-mark" aria-hidden="true" />
          {found.type}
        </strong>
        <button type="button" class="plain" ref={close} aria-label={text.close} onClick={leave}>
          ✕
        </button>
      </header>
      <DetectionPicture of={found} onEnlarge={() => enlarge(!large)} />
      <dl>
        <dt>{text.source}</dt>
        <dd>{found.source}</dd>
        <dt>{text.time}</dt>
        <dd>{clock(found.t_s)}</dd>
        <dt>{text.where}</dt>
        <dd>{positionOf(found)}</dd>
      </dl>
      {scene.seek && (
        <button type="button" class="secondary" onClick={() => scene.seek?.(found.t_s)}>
          {text.seek}
        </button>
      )}
    </section>
  );
}
