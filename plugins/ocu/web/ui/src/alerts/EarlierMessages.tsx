// Messages of this page that had to make room for newer ones.
import { timeOfDay } from "../shared/moments";
import { earlier } from "../shared/Toasts";
import { strings } from "../strings";
import "./alerts.css";

const words = strings.alerts;

export function EarlierMessages() {
  if (earlier.value.length === 0) return null;
  return (
    <section class="alert-earlier" aria-label={words.earlier}>
      <div class="alert-panel-head">
        <h2>{words.earlier}</h2>
        <button type="button" class="plain" onClick={() => (earlier.value = [])}>
          {words.clearEarlier}
        </button>
      </div>
      <ul>
        {earlier.value.map(({ id, text, tone, at_ms }) => (
          <li key={id} class={tone === "bad" ? "alert-earlier-bad" : undefined}>
            <time>{timeOfDay(at_ms)}</time> {text}
          </li>
        ))}
      </ul>
    </section>
  );
}
