// What the colours mean.
import { strings } from "../../strings";
import { useOperating } from "../context";
import { BREAKPOINT, NEXT } from "../debug/breakpoints";
import { isViolated, VIOLATION } from "../requirements/violations";
import { css, palette, SIGNS } from "./colours";

const text = strings.operate.diagram;

export function Legend() {
  const { scene } = useOperating();
  const violates = Object.values(scene.requirements.value).some(isViolated);
  const { elements = [], reached } = scene.debugging.value ?? {};
  const colours = palette.value;
  return (
    <ul class="legend" aria-label={text.legend}>
      {(["active", "done", "asking", "waiting", "failed"] as const).map((look) => {
        const { fill, ring, dash } = colours[look];
        const line = ring
          ? `2px ${dash.length > 0 ? "dashed" : "solid"} ${ring}`
          : "1px solid #777";
        return (
          <li key={look}>
            <i style={`background: ${css(fill)}; border: ${line}`} aria-hidden="true">
              {SIGNS[look]}
            </i>
            {text.states[look]}
          </li>
        );
      })}
      {violates && (
        <li>
          <i class="legend-requirement" aria-hidden="true">
            {VIOLATION}
          </i>
          {strings.monitors.legend}
        </li>
      )}
      {elements.length > 0 && <Sign sign={BREAKPOINT} means={strings.debug.legend} />}
      {reached?.element && <Sign sign={NEXT} means={strings.debug.legendNext} />}
    </ul>
  );
}

/** Of a run that is debugged. */
function Sign({ sign, means }: { sign: string; means: string }) {
  return (
    <li>
      <i class="legend-breakpoint" aria-hidden="true">
        {sign}
      </i>
      {means}
    </li>
  );
}
