// What a report assumes: why a rehearsal may fail although everything holds.
import { fill, strings } from "../../../strings";
import type { Report } from "./report";
import { tell } from "./report";

const words = strings.verify.assumed;

export function Assumed({ report, inOrder }: { report: Report; inOrder: boolean }) {
  const warned = [...tell(report, false), ...tell(report, true)].filter(
    ({ outcome }) => outcome === "warning",
  );
  const holds = report.verdict === "holds";
  return (
    <>
      {holds && warned.length > 0 && (
        <p class="m2v-but">
          {fill(words.but, { properties: warned.map(({ answer }) => answer.property).join(", ") })}
        </p>
      )}
      <details class="m2v-assumed-part">
        <summary>{words.title}</summary>
        <ul class="m2v-assumed">
          {report.assumed && <li>{fill(words.given, { assumed: report.assumed })}</li>}
          <li>{words.behaviors}</li>
          <li>{words.failures}</li>
          <li>{words.answers}</li>
          <li>{words.outside}</li>
          <li>{inOrder ? words.timersInOrder : words.timers}</li>
          <li>{words.notSeen}</li>
        </ul>
      </details>
    </>
  );
}
