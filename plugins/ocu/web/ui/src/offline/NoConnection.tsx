// Instead of a page, while the executive does not answer: what was known of it last, how old that is,
// and that STOP cannot be sent from here.
import { useEffect, useState } from "preact/hooks";
import { age } from "../shared/format";
import { moment } from "../shared/moments";
import { fill, strings } from "../strings";
import { lastKnown } from "./lastKnown";
import "./offline.css";

const text = strings.offline;
const statuses: Record<string, string> = strings.operate.run.status;

export function NoConnection() {
  const [known] = useState(lastKnown);
  const [, renew] = useState(0);
  useEffect(() => {
    const timer = setInterval(() => renew((count) => count + 1), 1000);
    return () => clearInterval(timer);
  }, []);
  return (
    <section class="no-connection" aria-label={text.title}>
      <h1>{text.title}</h1>
      <p>{text.again}</p>
      <p class="no-stop" role="alert">
        <strong>{text.noStop}</strong> {strings.shell.stopOtherwise}
      </p>
      {known ? (
        <>
          <h2>
            {known.fleet} ({known.simulated ? strings.shell.simulated : strings.shell.real})
          </h2>
          {/* Its age changes every second: not for screen readers, which have the time. */}
          <p>
            {fill(text.seen, { when: moment(known.at_ms) })}{" "}
            <span aria-hidden="true">
              {fill(text.ago, { age: age(Math.max(0, Date.now() - known.at_ms) / 1000) })}
            </span>
          </p>
          {known.runs.length === 0 ? (
            <p>{text.noRuns}</p>
          ) : (
            <>
              <p>{text.runs}</p>
              <ul>
                {known.runs.map(({ run, title, status }) => (
                  <li key={run}>
                    <b>{run}</b> {title}: {statuses[status] ?? status}
                  </li>
                ))}
              </ul>
            </>
          )}
        </>
      ) : (
        <p>{text.nothing}</p>
      )}
    </section>
  );
}
