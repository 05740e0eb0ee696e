// The chosen vehicle or payload in full, and commands to it, or to all that are selected.
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { titleOf } from "../editor/blocks/blocks";
import type { Catalogue } from "../editor/session/catalogue";
import { Link } from "../home/Link";
import { DomainSymbol } from "../operate/vehicles/DomainSymbol";
import { heading_deg } from "../shared/format";
import { ForceGiveBack } from "../people/ForceGiveBack";
import { isSelf } from "../people/people";
import { may } from "../shared/session";
import type { Behavior } from "../shared/types";
import { counted, fill, strings } from "../strings";
import { CommandForm } from "./CommandForm";
import { namesOf, order, refused, sending, type Verb } from "./commands";
import { inCommon, QUICK } from "./offers";
import type { Row } from "./rows";
import { centred, selected, targets } from "./state";
import { cellOf, holderOf } from "./text";
import { VehicleCameras } from "./VehicleCameras";

const text = strings.fleet;
const words = text.commands;
const MOST_NAMES = 20;

export interface CommandPanelProps {
  catalogue: Catalogue;
  offers: ReadonlyMap<string, readonly Behavior[]>;
  rows: ReadonlyMap<string, Row>;
}

export function CommandPanel({ catalogue, offers, rows }: CommandPanelProps) {
  const resources = targets();
  const known = resources.flatMap((resource) => rows.get(resource) ?? []);
  const [only] = known;
  return (
    <section class="fleet-panel" aria-label={text.panes.commands}>
      {known.length === 0 && <p class="nothing">{text.details.choose}</p>}
      {known.length === 1 && only && <Details row={only} />}
      {known.length === 1 && only && <VehicleCameras fleet={catalogue.fleet} resource={only.id} />}
      {known.length > 1 && <Names resources={resources} />}
      <Refused />
      {known.length > 0 &&
        (may("operator") ? (
          <Commands {...{ catalogue, offers, known, resources }} />
        ) : (
          <p class="m2-note">{words.viewer}</p>
        ))}
    </section>
  );
}

function Names({ resources }: { resources: readonly string[] }) {
  const more = resources.length - MOST_NAMES;
  return (
    <div class="fleet-details">
      <h2>{namesOf(resources)}</h2>
      <p>
        {resources.slice(0, MOST_NAMES).join(", ")}
        {more > 0 && ` ${fill(text.details.more, { count: more })}`}
      </p>
      <button type="button" class="plain" onClick={() => (selected.value = new Set())}>
        {text.clear}
      </button>
    </div>
  );
}

function Details({ row }: { row: Row }) {
  const { columns, details } = text;
  const facts: [string, string][] = [
    [columns.link, cellOf(row, "link")],
    [columns.battery, cellOf(row, "battery")],
    [columns.mode, cellOf(row, "mode")],
    [details.readiness, readinessOf(row)],
    [columns.speed, cellOf(row, "speed")],
    [columns.height, cellOf(row, "height")],
    [details.heading, row.yaw_rad === null ? "" : `${Math.round(heading_deg(row.yaw_rad))}°`],
    [columns.position, cellOf(row, "position")],
    [columns.failsafe, cellOf(row, "failsafe")],
    [details.arbiter, row.arbiter],
    [details.host, row.host || text.executiveHost],
  ];
  return (
    <div class="fleet-details">
      <h2>
        <DomainSymbol domain={row.domain} />
        {row.id}
        <span class={`fleet-pill fleet-${row.health}`}>{text.health[row.health]}</span>
      </h2>
      <p>
        <Holder row={row} />
        {row.doing && <span>{cellOf(row, "doing")}</span>}
        {row.latitude !== null && (
          <button
            type="button"
            class="plain"
            onClick={() => (centred.value = { resource: row.id })}
          >
            {strings.operate.vehicles.centre}
          </button>
        )}
      </p>
      {row.status?.unavailable && !row.operator && (
        <p class="warn">{fill(details.unavailable, { why: row.status.unavailable })}</p>
      )}
      <Reasons title={details.reasons} reasons={row.reasons} />
      <Reasons title={details.failsafeProblems} reasons={row.failsafeProblems ?? []} />
      <dl class="fleet-facts">
        {facts
          .filter(([, value]) => value)
          .map(([name, value]) => (
            <div key={name} title={name === columns.failsafe ? details.failsafeHint : undefined}>
              <dt>{name}</dt>
              <dd>{value}</dd>
            </div>
          ))}
      </dl>
    </div>
  );
}

function Reasons({ title, reasons }: { title: string; reasons: readonly string[] }) {
  if (reasons.length === 0) return null;
  return (
    <div class="warn">
      {title}:
      <ul>
        {reasons.map((reason) => (
          <li key={reason}>{reason}</li>
        ))}
      </ul>
    </div>
  );
}

function readinessOf({ ready, isPayload }: Row): string {
  if (isPayload) return "";
  if (ready === null) return text.details.unknown;
  return ready ? text.details.ready : text.details.notReady;
}

/** Who has it, with a link to the run that commands it. */
export function Holder({ row }: { row: Row }) {
  const who = holderOf(row);
  const run = row.status?.run ?? "";
  return (
    <span class={row.operator ? "warn" : undefined}>
      {who}
      {who && run && ", "}
      {run && (
        <Link to={`/runs/${encodeURIComponent(run)}`}>{fill(text.details.run, { run })}</Link>
      )}
    </span>
  );
}

function Refused() {
  if (refused.value.length === 0) return null;
  return (
    <div class="fleet-refused" role="alert">
      <strong>{words.problems}</strong>
      <ul>
        {refused.value.map(({ resource, problem }) => (
          <li key={resource}>
            <b>{resource}</b>: {problem}
          </li>
        ))}
      </ul>
      <button type="button" class="plain" onClick={() => (refused.value = [])}>
        {words.dismiss}
      </button>
    </div>
  );
}

interface CommandsProps {
  catalogue: Catalogue;
  offers: CommandPanelProps["offers"];
  known: readonly Row[];
  resources: readonly string[];
}

function Commands({ catalogue, offers, known, resources }: CommandsProps) {
  const chosen = useSignal("");
  const common = inCommon(offers, resources);
  const behavior = common.find(({ name }) => name === chosen.value);
  const key = resources.join(" ");
  useEffect(() => void (chosen.value = ""), [key]);
  const others = known.filter(({ operator }) => operator && !isSelf(operator));
  const isBusy = sending.value !== null;
  const verb = (name: Verb, label: string, isPossible: boolean) => (
    <button
      type="button"
      class="secondary"
      disabled={!isPossible || isBusy}
      onClick={() => void order({ verb: name, resources })}
    >
      {label}
    </button>
  );
  const choose = (name: string) => {
    const wanted = common.find((each) => each.name === name);
    chosen.value = "";
    if (!wanted) return;
    if (wanted.parameters.length > 0) chosen.value = name;
    else {
      const title = titleOf(name);
      void order({ verb: "execute", resources, behavior: { name, title, parameters: {} } });
    }
  };
  const quick = QUICK.flatMap((name) => common.find((each) => each.name === name) ?? []);
  const mayHold =
    common.some(({ name }) => name === "hold") ||
    known.some(({ status }) => status?.direct && !status.held);
  return (
    <div class="fleet-commands">
      <h2>{words.title}</h2>
      <p class="fleet-buttons">
        {verb("hold", words.hold, mayHold)}
        {verb("resume", words.resume, known.some(({ status }) => status?.held))}
        {verb("take", words.take, known.some(({ operator, manned }) => !operator && !manned))}
        {verb("give-back", words.giveBack, known.some(({ operator }) => isSelf(operator)))}
        {others.length > 0 && (
          <>
            <button
              type="button"
              class="secondary"
              disabled={isBusy}
              onClick={() =>
                void order({ verb: "request", resources: others.map(({ id }) => id) })
              }
            >
              {others.length === 1 ? words.request : words.requestMany}
            </button>
            <ForceGiveBack
              kind="secondary"
              held={others.map(({ id, operator }) => ({ resource: id, holder: operator }))}
            />
          </>
        )}
      </p>
      {common.length === 0 ? (
        <p class="m2-note">{resources.length === 1 ? words.noneOfOne : words.none}</p>
      ) : (
        <p class="fleet-buttons">
          {quick.map(({ name, parameters }) => (
            <button
              key={name}
              type="button"
              class="secondary"
              aria-pressed={chosen.value === name}
              disabled={isBusy}
              onClick={() => choose(name)}
            >
              {titleOf(name)}
              {parameters.length > 0 && "…"}
            </button>
          ))}
          <label>
            {words.other}{" "}
            <select
              value={chosen.value}
              disabled={isBusy}
              onChange={(event) => choose(event.currentTarget.value)}
            >
              <option value="">{words.chooseOther}</option>
              {common.map(({ name }) => (
                <option key={name} value={name}>
                  {titleOf(name)}
                </option>
              ))}
            </select>
          </label>
        </p>
      )}
      {sending.value && (
        <p role="status">{fill(words.sending, { ...sending.value })}</p>
      )}
      {behavior && (
        <CommandForm
          key={behavior.name}
          {...{ catalogue, behavior, resources }}
          onClose={() => (chosen.value = "")}
        />
      )}
      <span class="for-readers" role="status">
        {resources.length > 1 && counted(text.selected, resources.length)}
      </span>
    </div>
  );
}
