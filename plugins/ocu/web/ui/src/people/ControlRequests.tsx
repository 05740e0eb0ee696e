// On every page: who asks whom for a vehicle. Who has it gives it or keeps it.
import { useEffect, useState } from "preact/hooks";
import { clock } from "../shared/format";
import { may } from "../shared/session";
import { fill, strings } from "../strings";
import { answer, left_s, requests, type ControlRequest } from "./people";
import "./people.css";

const words = strings.people;

export function ControlRequests() {
  return (
    <div role="alert">
      {requests.value.map((request) => (
        <Request key={request.resource} request={request} />
      ))}
    </div>
  );
}

function Request({ request }: { request: ControlRequest }) {
  const { resource, by, holder, mine, own, holder_gone, given_then } = request;
  const asks = mine ? words.asks : own ? words.youAsk : words.asksOther;
  return (
    <div class={mine ? "control-request control-request-mine" : "control-request"}>
      <p>
        <strong>{fill(asks, { by, holder, resource })}</strong>{" "}
        {holder_gone && !mine && <span>{fill(words.gone, { holder })} </span>}
        <span>{given_then ? fill(words.goes, { by }) : words.stays}</span>{" "}
        <Left request={request} />
      </p>
      {may("operator") && mine && (
        <>
          <button type="button" class="control-request-give" onClick={() => void answer(resource, true)}>
            {words.give}
          </button>
          <button type="button" onClick={() => void answer(resource, false)}>
            {words.keep}
          </button>
        </>
      )}
      {may("operator") && own && (
        <button type="button" onClick={() => void answer(resource, false)}>
          {words.withdraw}
        </button>
      )}
    </div>
  );
}

/** Not read aloud every second. */
function Left({ request }: { request: ControlRequest }) {
  const [, renew] = useState(0);
  useEffect(() => {
    const timer = setInterval(() => renew((count) => count + 1), 1000);
    return () => clearInterval(timer);
  }, []);
  const left = Math.ceil(left_s(request));
  return <b aria-hidden="true">{left < 60 ? `${left} s` : clock(left)}</b>;
}
