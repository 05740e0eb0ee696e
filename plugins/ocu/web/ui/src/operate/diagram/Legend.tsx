// What the colours mean.
import { strings } from "../../strings";
import { css, palette, SIGNS } from "./colours";

const text = strings.operate.diagram;

export function Legend() {
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
    </ul>
  );
}
