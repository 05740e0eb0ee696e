// What the run is monitored for, and what is certain of it at the moment that is shown.
import { clockTenths } from "../../shared/format";
import type { Requirement } from "../../shared/types";
import { fill, strings } from "../../strings";
import { useOperating } from "../context";
import { Pane } from "../layout/Pane";
import { Verdict } from "./Verdict";
import { inOrder, placesOf } from "./violations";

const text = strings.monitors;

export default function RequirementsPane() {
  const { scene, mission, selected, surrounded } = useOperating();
  const all = inOrder(scene.requirements.value);
  const show = (requirement: Requirement) => {
    const places = placesOf(requirement, mission);
    surrounded.value = places.map(({ process, id }) => ({ process, element: id }));
    const [first] = surrounded.value;
    if (first) selected.value = { ...first, show: true };
    // Just before its record the verdict is not shown, although it was certain.
    if (requirement.recorded !== null) scene.seek?.(requirement.recorded);
  };
  const hintOf = ({ recorded: at }: Requirement) =>
    scene.seek && at !== null ? fill(text.showAt, { time: clockTenths(at) }) : text.show;
  return (
    <Pane title={text.title} class="requirements-pane" scrolls>
      {all.length === 0 && <p class="nothing">{text.none}</p>}
      <ul class="verdicts">
        {all.map(([name, requirement]) => (
          <Verdict
            key={name}
            name={name}
            requirement={requirement}
            status={scene.status.value}
            hint={hintOf(requirement)}
            onShow={() => show(requirement)}
          >
            <Elements of={requirement} />
          </Verdict>
        ))}
      </ul>
    </Pane>
  );
}

function Elements({ of }: { of: Requirement }) {
  const { mission, selected } = useOperating();
  const places = placesOf(of, mission);
  if (places.length === 0) return null;
  return (
    <p class="verdict-elements">
      {text.elements}:{" "}
      {places.map(({ process, id, label }) => (
        <button
          key={`${process} ${id}`}
          type="button"
          class="plain"
          onClick={() => (selected.value = { process, element: id, show: true })}
        >
          {label}
        </button>
      ))}
    </p>
  );
}
