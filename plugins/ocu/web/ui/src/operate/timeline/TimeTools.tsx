// Buttons that choose what is seen of a run's time.
import type { ComponentChildren } from "preact";
import { strings } from "../../strings";
import { useOperating } from "../context";
import type { TimeWindow } from "./useTimeWindow";

const text = strings.operate.timeline;

/** Where `now` comes to be in the window. */
const NOW_AT = 0.7;

export function TimeTools({ shown, children }: { shown: TimeWindow; children?: ComponentChildren }) {
  const { scene } = useOperating();
  const { window, width, zoom, choose } = shown;
  return (
    <div class="tools">
      {children}
      <button
        type="button"
        class="plain"
        aria-label={text.zoomOut}
        onClick={() => zoom(1 / 1.5)}
      >
        −
      </button>
      <button type="button" class="plain" aria-label={text.zoomIn} onClick={() => zoom(1.5)}>
        +
      </button>
      <button type="button" class="plain" onClick={() => choose(null)}>
        {text.all}
      </button>
      <button
        type="button"
        class="plain"
        onClick={() => {
          const from_s = Math.max(0, scene.now() - (width * NOW_AT) / window.px_per_s);
          choose({ px_per_s: window.px_per_s, from_s });
        }}
      >
        {text.now}
      </button>
    </div>
  );
}
