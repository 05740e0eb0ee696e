// The title of the tab: how many are violated is said on it, too.
import { fill, strings } from "../../strings";
import { useOperating } from "../context";
import { isViolated, VIOLATION } from "./violations";

const text = strings.monitors;

export function RequirementsTitle() {
  const { scene } = useOperating();
  const violated = Object.values(scene.requirements.value).filter(isViolated).length;
  return (
    <>
      {text.title}
      {violated > 0 && (
        <span class="violated-count">
          <span aria-hidden="true">{VIOLATION} </span>
          {fill(text.titleViolated, { count: violated })}
        </span>
      )}
    </>
  );
}
