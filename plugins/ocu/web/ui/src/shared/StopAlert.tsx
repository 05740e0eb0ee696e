// Says that a STOP was not delivered, from the moment that is known until it is.
import { useEffect, useState } from "preact/hooks";
import { fill, strings } from "../strings";
import { connection } from "./executive";
import { giveUp, stops, type Stop } from "./stopping";

const text = strings.shell;

export function StopAlert() {
  const isDead = connection.value !== "open";
  const failed = stops.value.filter(({ state }) => state !== "sending" || isDead);
  return (
    <div role="alert">
      {failed.map((stop) => (
        <NotDelivered key={stop.path} stop={stop} />
      ))}
    </div>
  );
}

function NotDelivered({ stop: { path, what, given_ms, state, why } }: { stop: Stop }) {
  return (
    <div class="undelivered">
      <p>
        <strong>{text.stopUndelivered}</strong>{" "}
        <span>{fill(state === "refused" ? text.stopRefused : text.stopRetried, { what })}</span>{" "}
        {why && <span>{why}. </span>}
        <b>{text.stopOtherwise}</b>
      </p>
      <Age since_ms={given_ms} />
      <button type="button" onClick={() => giveUp(path)}>
        {state === "refused" ? text.dismiss : text.stopGiveUp}
      </button>
    </div>
  );
}

/** Not for screen readers, which would read it every second. */
function Age({ since_ms }: { since_ms: number }) {
  const [, renew] = useState(0);
  useEffect(() => {
    const timer = setInterval(() => renew((count) => count + 1), 1000);
    return () => clearInterval(timer);
  }, []);
  return <span aria-hidden="true">{Math.floor((performance.now() - since_ms) / 1000)} s</span>;
}
