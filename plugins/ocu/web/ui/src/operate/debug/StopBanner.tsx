// Where a run is stopped to look at it, and why; what an operator may let it do.
import { command } from "../../shared/command";
import type { Around, Reached } from "../../shared/types";
import { fill, strings } from "../../strings";
import { useOperating } from "../context";
import { Icon } from "../layout/icons";
import { showDebugging } from "../layout/chosenTabs";
import type { MissionModel } from "../mission/missionModel";
import { NEXT } from "./breakpoints";
import { pathOf, refusalOf } from "./setting";
import "./debug.css";

const text = strings.debug;

export default function StopBanner() {
  const shown = useOperating();
  const { scene, mission, selected } = shown;
  const debugging = scene.debugging.value;
  const reached = debugging?.reached;
  if (!reached) {
    return (
      <section class="stop-banner" aria-label={text.banner}>
        <p role="status">{text.stepping}</p>
      </section>
    );
  }
  const { process, element } = reached;
  const label = mission.label(process, element);
  const ask = (what: string) => void command(`${pathOf(shown)}/${what}`);
  return (
    <section class="stop-banner" aria-label={text.banner}>
      <p role="status">
        <span aria-hidden="true">{NEXT} </span>
        {element ? (
          <button
            type="button"
            class="stop-where"
            onClick={() => (selected.value = { process, element, show: true })}
          >
            {fill(text.stopped, { element: numbered(label, reached.instance) })}
          </button>
        ) : (
          <strong>{text.stoppedOutside}</strong>
        )}{" "}
        {surroundings(reached, mission)} <small>{reasonOf(reached)}</small>
      </p>
      {refusalOf(shown) === "" && (
        <div class="stop-acts">
          <button type="button" class="secondary" title={text.stepHint} onClick={() => ask("step")}>
            <Icon name="forward" />
            {text.step}
          </button>
          <button type="button" class="primary" onClick={() => ask("resume")}>
            <Icon name="play" />
            {text.resume}
          </button>
        </div>
      )}
      {scene.mode === "live" && (
        <button type="button" class="secondary" onClick={showDebugging}>
          {text.show}
        </button>
      )}
    </section>
  );
}

const numbered = (element: string, instance: number | null): string =>
  instance === null ? element : fill(text.instance, { element, number: instance + 1 });

export const reasonOf = ({ reason, condition }: Pick<Reached, "reason" | "condition">): string =>
  fill(text.reasons[reason], { condition });

/** In which branch it is, and of which vehicles. */
function surroundings({ within, resources }: Reached, mission: MissionModel): string {
  const placed = ({ process, element, instance }: Around) =>
    numbered(mission.label(process, element), instance);
  return [
    within.length > 0 && fill(text.within, { places: within.map(placed).join(" › ") }),
    resources.length > 0 && fill(text.commands, { resources: resources.join(", ") }),
  ]
    .filter(Boolean)
    .join(", ");
}
