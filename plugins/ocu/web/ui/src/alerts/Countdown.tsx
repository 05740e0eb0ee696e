// How long a question can still be answered.
import { fill, strings } from "../strings";
import { leftOf_s, span } from "./alerts";
import "./alerts.css";

const HURRY_S = 30;

export function Countdown({ run, prompt }: { run: string; prompt: string }) {
  const left_s = leftOf_s(run, prompt);
  if (left_s === null) return null;
  const left = span(left_s);
  // Not read aloud every second.
  return (
    <span
      class={left_s <= HURRY_S ? "countdown countdown-hurry" : "countdown"}
      role="timer"
      aria-label={fill(strings.alerts.leftFor, { left })}
    >
      {fill(strings.alerts.left, { left })}
    </span>
  );
}
