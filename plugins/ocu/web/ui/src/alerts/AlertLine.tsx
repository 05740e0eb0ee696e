// Parts of an alert that the panel and the page show alike.
import { go } from "../shared/router";
import { may, session } from "../shared/session";
import { counted, fill, strings } from "../strings";
import { acknowledge, leftOf_s, own, passed_s, span, ticks } from "./alerts";
import type { OperatorAlert, Severity } from "./types";

const words = strings.alerts;
const SHOWN_NAMES = 3;

/** Its shape tells a severity where colours do not. */
const MARKS: Record<Severity, string> = {
  critical: "M8 1 15 8 8 15 1 8z",
  error: "M5 1h6l4 4v6l-4 4H5l-4-4V5z",
  warning: "M8 1.5 15.5 14.5H.5z",
  notice: "M8 1a7 7 0 1 0 0 14A7 7 0 0 0 8 1z",
};

export function SeverityMark({ severity }: { severity: Severity }) {
  return (
    <span class={`severity severity-${severity}`}>
      <svg viewBox="0 0 16 16" width="14" height="14" aria-hidden="true">
        <path d={MARKS[severity]} fill="currentColor" />
      </svg>
      {words.severity[severity]}
    </span>
  );
}

/** Where it comes from: a run, and vehicles or payloads. */
export function Source({ alert, leave }: { alert: OperatorAlert; leave?: () => void }) {
  const { run, resources } = alert;
  const names = resources.slice(0, SHOWN_NAMES).join(", ");
  const more = resources.length - SHOWN_NAMES;
  const path = `/runs/${encodeURIComponent(run)}`;
  return (
    <>
      {run && (
        <a
          href={path}
          onClick={(event) => {
            if (event.ctrlKey || event.metaKey || event.shiftKey || event.button !== 0) return;
            event.preventDefault();
            leave?.();
            go(path);
          }}
        >
          {run}
        </a>
      )}
      {run && names && " · "}
      {names && (
        <span title={resources.slice(0, 100).join(", ")}>
          {names}
          {more > 0 && ` ${counted(words.more, more)}`}
        </span>
      )}
    </>
  );
}

/** Its text, how often it was said, what else was said, and how long a question can be answered. */
export function AlertText({ alert }: { alert: OperatorAlert }) {
  const { text, count, details, run, subject } = alert;
  const left_s = alert.code === "QUESTION" ? leftOf_s(run, subject) : null;
  return (
    <>
      <span class="alert-text">{text}</span>
      {count > 1 && <small> {fill(words.times, { count })}</small>}
      {left_s !== null && (
        <b class="countdown"> {fill(words.left, { left: span(left_s) })}</b>
      )}
      {details.length > 0 && (
        <details class="alert-details">
          <summary>{counted(words.details, details.length)}</summary>
          <ul>
            {details.map((each) => (
              <li key={each}>{each}</li>
            ))}
          </ul>
        </details>
      )}
    </>
  );
}

export function Age({ alert }: { alert: OperatorAlert }) {
  void ticks.value;
  const age_s = alert.cleared_us === null ? alert.age_s + passed_s() : alert.age_s;
  return <>{span(age_s)}</>;
}

/** What an operator can do about it. */
export function AlertActions({ alert }: { alert: OperatorAlert }) {
  const { alert: id, text, calls, owner, cleared_us } = alert;
  if (!may("operator") || cleared_us !== null) return null;
  const mine = owner !== "" && owner === session.value?.user;
  const ownLabel = fill(mine ? words.disownLabel : words.ownLabel, { alert: id, text });
  return (
    <>
      {calls && (
        <button
          type="button"
          class="secondary"
          aria-label={fill(words.acknowledgeLabel, { alert: id, text })}
          onClick={() => void acknowledge(id)}
        >
          {words.acknowledge}
        </button>
      )}
      <button
        type="button"
        class="plain"
        aria-label={ownLabel}
        onClick={() => void own(id, mine)}
      >
        {mine ? words.disown : words.own}
      </button>
    </>
  );
}
