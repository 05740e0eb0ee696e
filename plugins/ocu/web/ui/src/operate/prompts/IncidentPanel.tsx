// Errors that stop a task: what an operator can do about them, and what would follow.
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { ApiError, get, post } from "../../shared/api";
import { givenNow } from "../../shared/command";
import { listen } from "../../shared/executive";
import { may } from "../../shared/session";
import { toast } from "../../shared/Toasts";
import type { Outlook } from "../../shared/types";
import { fill, strings } from "../../strings";
import { useOperating } from "../context";
import { blockedBy, heldFor } from "../../home/blocking";
import { resources } from "../vehicles/resources";
import { dataOf } from "../runbar/data";

const text = strings.operate.incidents;

/** What follows a choice is explored before it is made. */
const LIMIT_MS = 60_000;
const AGAIN_MS = 2000;

interface Incident {
  run: string;
  incident: string;
  element: string;
  task: string;
  code: string;
  reason: string;
  choices: string[];
  resources: string[];
  roles: Record<string, string[]>;
  targets: Record<string, string>;
  operator_role: string;
}

interface Wanted {
  choice: string;
  data?: Record<string, unknown>;
  to?: string;
  roles?: Record<string, string[]>;
  even_if_stuck?: boolean;
}

const idOf = ({ run, incident }: Incident): string => `${run}/${incident}`;

export function IncidentPanel() {
  const { scene } = useOperating();
  const incidents = useSignal<Incident[]>([]);
  const chosen = useSignal("");
  const choice = useSignal("");
  const typed = useSignal("");
  const role = useSignal("");
  const said = useSignal("");
  const stuck = useSignal(false);
  const busy = useSignal(false);

  const load = async () => {
    try {
      incidents.value = await get<Incident[]>("/incidents");
    } catch {
      // The next time will do; the connection bar says what is wrong.
    }
  };
  useEffect(() => {
    void load();
    const again = setInterval(() => {
      if (incidents.value.length) void load();
    }, AGAIN_MS);
    const stop = listen((message) => {
      if (message.type === "fault" || message.type === "snapshot" || message.type === "run")
        void load();
    });
    return () => {
      clearInterval(again);
      stop();
    };
  }, []);

  // Those of the run that is shown come first.
  const own = ({ run }: Incident) => Number(run !== scene.run);
  const queue = [...incidents.value].sort((one, other) => own(one) - own(other));
  const at = Math.max(
    0,
    queue.findIndex((each) => idOf(each) === chosen.value),
  );
  const incident = queue[at];
  const id = incident ? idOf(incident) : "";
  useEffect(() => {
    choice.value = incident?.choices[0] ?? "";
    role.value = Object.keys(incident?.roles ?? {})[0] ?? "";
    typed.value = said.value = "";
    stuck.value = false;
  }, [id]);
  if (!incident) return null;

  const wanted = (): Wanted | null => {
    const made: Wanted = { choice: choice.value };
    if (made.choice === "set_data") {
      const data = dataOf(typed.value);
      if (data === null) {
        toast(text.dataWrong, "bad");
        return null;
      }
      made.data = data;
    } else if (made.choice === "move") made.to = typed.value;
    else if (made.choice === "retry_with")
      made.roles = { [role.value]: typed.value.split(",").map((name) => name.trim()) };
    return made;
  };
  const path = `/runs/${encodeURIComponent(incident.run)}/incidents/${encodeURIComponent(incident.incident)}`;
  const send = async (where: string, more: Partial<Wanted>) => {
    const made = wanted();
    if (!made || busy.value) return;
    busy.value = true;
    try {
      const body = { ...made, ...more };
      const options = { limit_ms: LIMIT_MS, headers: givenNow() };
      const found = await post<Outlook | undefined>(where, body, options);
      const lines = found ? [found, ...found.requirements] : [];
      said.value = lines.map((each) => each.text).join("\n");
      stuck.value = false;
      if (!found) typed.value = "";
    } catch (error) {
      stuck.value = error instanceof ApiError && error.problem["stuck"] === true;
      said.value = error instanceof Error ? error.message : String(error);
    } finally {
      busy.value = false;
      void load();
    }
  };
  const change = (value: string) => {
    choice.value = value;
    typed.value = said.value = "";
    stuck.value = false;
  };
  const usable = may("operator") && !busy.value;
  const title = fill(text.title, { task: incident.task, run: incident.run });
  const needs = ["set_data", "move", "retry_with"].includes(choice.value);
  return (
    <section class="prompt incident" role="alertdialog" aria-label={title}>
      <div class="prompt-about">
        <strong>{title}</strong>
        <span>{heldFor(incident, blockedBy(incident, resources.value.waiting))}</span>
        {incident.operator_role && (
          <span>{fill(text.decides, { role: incident.operator_role })}</span>
        )}
      </div>
      <p>
        {incident.code}
        {incident.reason && `: ${incident.reason}`}
        {said.value && <small role="status">{said.value}</small>}
      </p>
      <form
        class="prompt-decisions"
        onSubmit={(event) => {
          event.preventDefault();
          void send(path, {});
        }}
      >
        <select
          aria-label={text.choice}
          value={choice.value}
          onChange={(event) => change(event.currentTarget.value)}
        >
          {incident.choices.map((each) => (
            <option key={each} value={each}>
              {(text.choices as Record<string, string>)[each] ?? each}
            </option>
          ))}
        </select>
        {choice.value === "retry_with" && (
          <select
            aria-label={text.role}
            value={role.value}
            onChange={(event) => (role.value = event.currentTarget.value)}
          >
            {Object.keys(incident.roles).map((each) => (
              <option key={each}>{each}</option>
            ))}
          </select>
        )}
        {choice.value === "move" ? (
          <select
            aria-label={text.to}
            value={typed.value}
            onChange={(event) => (typed.value = event.currentTarget.value)}
          >
            <option value="">{text.to}</option>
            {Object.entries(incident.targets).map(([target, label]) => (
              <option key={target} value={target}>
                {label}
              </option>
            ))}
          </select>
        ) : (
          needs && (
            <input
              aria-label={choice.value === "set_data" ? text.data : text.resource}
              placeholder={choice.value === "set_data" ? text.data : text.resource}
              value={typed.value}
              onInput={(event) => (typed.value = event.currentTarget.value)}
            />
          )
        )}
        <button type="button" disabled={!usable} onClick={() => void send(`${path}/preview`, {})}>
          {text.preview}
        </button>
        <button type="submit" disabled={!usable || (needs && !typed.value)}>
          {text.decide}
        </button>
        {stuck.value && (
          <button
            type="button"
            disabled={!usable}
            onClick={() => void send(path, { even_if_stuck: true })}
          >
            {text.anyway}
          </button>
        )}
        {queue.length > 1 && (
          <button
            type="button"
            class="prompt-next"
            onClick={() => (chosen.value = idOf(queue[(at + 1) % queue.length]!))}
          >
            {fill(text.next, { number: at + 1, count: queue.length })}
          </button>
        )}
      </form>
    </section>
  );
}
