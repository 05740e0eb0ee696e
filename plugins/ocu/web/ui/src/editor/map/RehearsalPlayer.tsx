// A rehearsal of the draft, played on the map and on the diagram.
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { loadReplay } from "../../operate/loading";
import { Player } from "../../operate/player/Player";
import type { ReplayScene } from "../../operate/scene/replayScene";
import { attempt } from "../../shared/Toasts";
import { VehicleList } from "../../map/VehicleList";
import type { VehicleMark } from "../../operate/map/vehicleLayer";
import { strings } from "../../strings";
import type { EditorContext } from "../panels/panel";
import type { PlayedRehearsal } from "./plan";
import type { PlanMap } from "./planMap";
import "../../operate/map/map.css";

const words = strings.plan;
const LAYER = "rehearsal";
/** In seconds of the rehearsal for one of the clock on the wall, at first. */
const SPEED = 10;

export interface RehearsalPlayerProps {
  editor: EditorContext;
  rehearsal: PlayedRehearsal;
  map(): PlanMap | undefined;
}

export function RehearsalPlayer({ editor, rehearsal, map }: RehearsalPlayerProps) {
  const scene = useSignal<ReplayScene | null>(null);
  const listed = useSignal<readonly VehicleMark[]>([]);
  useEffect(() => {
    let left = false;
    void attempt(async () => {
      const { id, summary } = rehearsal;
      const made = await loadReplay({ kind: "rehearsal", id }, summary, () => undefined);
      if (left) return made.dispose();
      made.speed.value = SPEED;
      scene.value = made;
    });
    return () => {
      left = true;
      scene.peek()?.dispose();
    };
  }, []);
  useEffect(() => {
    const { at } = rehearsal;
    if (at === undefined) return scene.value?.play();
    scene.value?.pause();
    scene.value?.seek(at);
  }, [scene.value, rehearsal]);
  useEffect(() => {
    const [shown, on] = [scene.value, map()];
    if (!shown || !on) return undefined;
    const layer = on.vehicles;
    layer.show({ trails: true, names: true, footprints: true });
    const stops = [
      layer.listed.subscribe((now) => (listed.value = now)),
      shown.vehicles.subscribe((states) => layer.vehicles(states, shown.pace.peek())),
      shown.payloads.subscribe((states) => layer.payloads(states)),
      shown.jumps.subscribe(() => layer.retrace((resource) => shown.trail(resource))),
      shown.events.subscribe(() => editor.mark(LAYER, activeIn(shown))),
    ];
    return () => {
      for (const stop of stops) stop();
      layer.vehicles({}, 1);
      layer.payloads({});
      layer.show({ trails: false, names: true, footprints: false });
      editor.mark(LAYER, {});
    };
  }, [scene.value]);
  return (
    <div class="plan-player">
      <VehicleList vehicles={listed} />
      {scene.value ? (
        <Player scene={scene.value} embedded />
      ) : (
        <p role="status">{strings.operate.run.loading}</p>
      )}
      <button
        type="button"
        class="plain"
        aria-label={words.endRehearsal}
        title={words.endRehearsal}
        onClick={() => (editor.plan.rehearsal.value = null)}
      >
        ×
      </button>
    </div>
  );
}

/** The classes of elements that are active at that moment of it. */
function activeIn(scene: ReplayScene): Record<string, string> {
  const active = [...scene.elements.all()].filter(([, , state]) => state.active > 0);
  return Object.fromEntries(active.map(([, element]) => [element, "m2-rehearsed"]));
}
