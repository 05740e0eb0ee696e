// All that payloads detected in a run, the newest first.
import { useSignal } from "@preact/signals";
import { clock } from "../../shared/format";
import { fill, strings } from "../../strings";
import { useOperating } from "../context";
import { Pane } from "../layout/Pane";
import DetectionCard from "./DetectionCard";
import { positionOf } from "./position";
import "./detections.css";

const text = strings.operate.detections;

/** So many are listed at first, and more of each time that older ones are wanted. */
const LISTED = 200;

/** `inside`: the card of the one that is chosen is here, where there is no room for the map. */
export default function DetectionsPane({ inside }: { inside: boolean }) {
  const { scene, detection } = useOperating();
  const listed = useSignal(LISTED);
  const { all, more } = scene.detections.value;
  const older = Math.max(0, all.length - listed.value);
  const choose = (number: number, t_s: number) => {
    scene.seek?.(t_s);
    detection.value = number;
  };
  return (
    <Pane title={fill(text.title, { count: all.length + more })} class="detections-pane" scrolls>
      {all.length === 0 && <p class="nothing">{text.none}</p>}
      <ul class="detections">
        {all
          .slice(older)
          .reverse()
          .map((each) => (
            <li key={each.number}>
              <button
                type="button"
                class="plain"
                aria-current={each.number === detection.value}
                onClick={() => choose(each.number, each.t_s)}
              >
                <span class="detection-time">{clock(each.t_s)}</span>
                <i class="detection-mark" aria-hidden="true" />
                <strong>{each.type}</strong>
                <span>{each.source}</span>
                <small>{positionOf(each)}</small>
                {each.picture !== undefined && <small>{text.hasPicture}</small>}
              </button>
            </li>
          ))}
      </ul>
      {older > 0 && (
        <button type="button" class="plain" onClick={() => (listed.value += LISTED)}>
          {fill(text.older, { count: older })}
        </button>
      )}
      {more > 0 && <p class="nothing">{fill(text.more, { count: more })}</p>}
      {inside && detection.value !== null && <DetectionCard />}
    </Pane>
  );
}
