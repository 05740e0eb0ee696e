// Each vehicle: how it is, what it does and for which element, and who has it.
import { Component } from "preact";
import { useRef } from "preact/hooks";
import { usePaced } from "../layout/pace";
import { age, fixed, heading_deg, speed_m_s, STALE_S } from "../../shared/format";
import { askFor, isSelf, requests } from "../../people/people";
import { unknownSince } from "../../shared/executive";
import { timeOfDay } from "../../shared/moments";
import { may } from "../../shared/session";
import { order } from "../../fleet/commands";
import { ForceGiveBack } from "../../people/ForceGiveBack";
import { command } from "../../shared/command";
import { toast } from "../../shared/Toasts";
import { fill, strings } from "../../strings";
import type { Fleet, PayloadState, VehicleState } from "../../shared/types";
import { useOperating } from "../context";
import { Pane } from "../layout/Pane";
import { DomainSymbol } from "./DomainSymbol";
import { Sparklines } from "../plots/Sparklines";
import { SharedSpaces } from "./SharedSpaces";
import { Teams } from "./Teams";
import { resources } from "./resources";
import { heldElsewhere, isOperator, payloadsOf, waitersOf, workOf } from "./work";
import { Turns, useSeen } from "./turns";
import "./vehicles.css";

const text = strings.operate.vehicles;

/** Nobody reads numbers that change faster. */
const PACE_MS = 400;

export function VehiclesPane() {
  const { scene, fleet } = useOperating();
  const states = usePaced(scene.vehicles, PACE_MS);
  const payloads = usePaced(scene.payloads, PACE_MS);
  // Ages grow without any message.
  usePaced(scene.time, 1000);
  const list = useRef<HTMLUListElement>(null);
  const seen = useSeen(list, fleet.vehicles.length);
  const turns = useRef(new Turns());
  const now = turns.current.take(fleet.vehicles.length, (index) => seen.has(index));
  return (
    <Pane title={strings.operate.panes.vehicles} class="vehicles-pane" scrolls>
      {fleet.vehicles.length === 0 && <p class="nothing">{text.none}</p>}
      <ul class="cards" ref={list}>
        {fleet.vehicles.map((vehicle, index) => (
          <CardInTurn
            key={vehicle.id}
            vehicle={vehicle}
            state={states[vehicle.id]}
            payloads={payloads}
            silent_s={scene.silentFor_s(vehicle.id)}
            hasTurn={now[index]!}
          />
        ))}
      </ul>
      <Teams />
      <SharedSpaces />
    </Pane>
  );
}

interface CardProps {
  vehicle: Fleet["vehicles"][number];
  state: VehicleState | undefined;
  payloads: Record<string, PayloadState>;
  silent_s: number | null;
}

/** Drawn again when it has its turn; at once when what it does or who has it changes. */
class CardInTurn extends Component<CardProps & { hasTurn: boolean }> {
  override shouldComponentUpdate({ hasTurn }: { hasTurn: boolean }): boolean {
    return hasTurn;
  }

  render({ hasTurn: _, ...card }: CardProps & { hasTurn: boolean }) {
    return <Card {...card} />;
  }
}

function Card({ vehicle, state, payloads, silent_s }: CardProps) {
  const { scene, fleet, followed, centred } = useOperating();
  const { hasTelemetry } = scene;
  const since = scene.mode === "live" ? unknownSince.value : null;
  const stale = hasTelemetry && (since !== null || isStale(state, silent_s));
  return (
    <li class={stale ? "card card-stale" : "card"}>
      <div class="card-head">
        <DomainSymbol domain={vehicle.domain} />
        <strong>{vehicle.id}</strong>
        <span class="for-readers">{text.domain[vehicle.domain]}</span>
        {vehicle.manned && <small>{text.manned}</small>}
        <span class="card-badges">
          {state && <Badges state={state} />}
          {hasTelemetry && silent_s === null && <em>{text.unheard}</em>}
          {since !== null ? (
            <em>{fill(strings.shell.unknownSince, { time: timeOfDay(since) })}</em>
          ) : (
            silent_s !== null &&
            silent_s > STALE_S && <em>{fill(text.silent, { age: age(silent_s) })}</em>
          )}
        </span>
      </div>
      {state && <Numbers state={state} />}
      {state && hasTelemetry && <Sparklines resource={vehicle.id} />}
      {state && state.not_ready_reasons.length > 0 && (
        <p class="card-reasons">
          {state.ready === false && `${text.notReady}: `}
          {state.not_ready_reasons.join("; ")}
        </p>
      )}
      <Doing resource={vehicle.id} name={text.does} />
      {payloadsOf(fleet, vehicle.id).map((payload) => (
        <Doing
          key={payload}
          resource={payload}
          name={payload.slice(vehicle.id.length + 1)}
          look={payloads[payload]}
        />
      ))}
      {hasTelemetry && (
        <div class="card-tools">
          <HandOver resource={vehicle.id} />
          <button
            type="button"
            class="plain"
            disabled={!state?.position}
            onClick={() => (centred.value = { resource: vehicle.id })}
          >
            {text.centre}
          </button>
          <button
            type="button"
            class="plain"
            aria-pressed={followed.value === vehicle.id}
            disabled={!state?.position}
            onClick={() => {
              followed.value = followed.value === vehicle.id ? "" : vehicle.id;
            }}
          >
            {text.follow}
          </button>
        </div>
      )}
    </li>
  );
}

const isStale = (state: VehicleState | undefined, silent_s: number | null): boolean =>
  !state || silent_s === null || silent_s > STALE_S || state.link === "lost";

function Badges({ state }: { state: VehicleState }) {
  const { link, armed, ready, battery_fraction } = state;
  const low = battery_fraction !== null && battery_fraction < 0.25;
  return (
    <>
      {link !== "connected" && <b class="bad">{text.links[link]}</b>}
      {armed !== null && <b class={armed ? "good" : ""}>{armed ? text.armed : text.disarmed}</b>}
      {ready === false && <b class="warn">{text.notReady}</b>}
      {battery_fraction !== null && (
        <b class={low ? "bad" : ""} title={text.battery}>
          {Math.round(battery_fraction * 100)} %
        </b>
      )}
    </>
  );
}

function Numbers({ state }: { state: VehicleState }) {
  const { mode, velocity_enu_m_s, altitude_above_home_m, yaw_rad } = state;
  const facts: [string, string][] = [];
  if (mode) facts.push([text.mode, mode]);
  if (velocity_enu_m_s) facts.push([text.speed, `${fixed(speed_m_s(velocity_enu_m_s), 1)} m/s`]);
  if (yaw_rad !== null) facts.push([text.heading, `${Math.round(heading_deg(yaw_rad)) % 360}°`]);
  if (altitude_above_home_m !== null) {
    facts.push([text.altitude, `${fixed(altitude_above_home_m, 1)} m`]);
  }
  return (
    <dl class="card-numbers">
      {facts.map(([name, value]) => (
        <div key={name}>
          <dt>{name}</dt>
          <dd>{value}</dd>
        </div>
      ))}
    </dl>
  );
}

interface DoingProps {
  resource: string;
  name: string;
  look?: PayloadState | undefined;
}

/** What a vehicle or payload does, and for which element: click to see it in the diagram. */
function Doing({ resource, name, look }: DoingProps) {
  const { scene, mission, selected } = useOperating();
  const work = workOf(resource, scene.commands.value);
  const holder = scene.holders.value[resource] ?? "";
  const { labels, waiting } = resources.value;
  const held = heldElsewhere(resource, holder, scene.run, labels);
  const waits = waitersOf(resource, waiting);
  return (
    <p class="card-work">
      <span>{name}</span>{" "}
      {held && (isOperator(holder) || work.length === 0) ? (
        <b class="warn">{held}</b>
      ) : work.length === 0 ? (
        <i>{text.idle}</i>
      ) : (
        work.map(({ behavior, command: { name: does, process, element } }) => (
          <button
            key={behavior}
            type="button"
            onClick={() => (selected.value = { process, element, show: true })}
          >
            {mission.label(process, element)} <small>{does}</small>
          </button>
        ))
      )}
      {waits && <small>{waits}</small>}
      {look && look.footprint.length > 0 && <small> {directionOf(look)}</small>}
      {isPayload(resource) && <HandOver resource={resource} name={name} />}
    </p>
  );
}

const isPayload = (resource: string) => resource.includes("/");

/** Of a camera: from the bow, up or down, and how near. */
function directionOf({ pan_rad, tilt_rad, zoom }: PayloadState): string {
  const degrees = (rad: number) => `${Math.round((rad * 180) / Math.PI)}°`;
  return [
    pan_rad !== null && `↻ ${degrees(pan_rad)}`,
    tilt_rad !== null && `↕ ${degrees(tilt_rad)}`,
    zoom !== null && zoom !== 1 && `×${fixed(zoom, 1)}`,
  ]
    .filter(Boolean)
    .join(" ");
}

/** `name`: of a payload, which has its button in its line. */
function HandOver({ resource, name }: { resource: string; name?: string }) {
  const { scene } = useOperating();
  if (scene.mode !== "live" || !may("operator")) return null;
  const holder = scene.holders.value[resource] ?? "";
  const giveBack = async () => {
    const path = resource.split("/").map(encodeURIComponent).join("/");
    if (await command(`/resources/${path}/give-back`)) {
      toast(fill(text.given, { resource }), "good");
    }
  };
  const kind = name ? "card-hand-over" : "secondary";
  const label = (act: string) => (name ? `${act} ${name}` : undefined);
  if (isOperator(holder)) {
    if (!isSelf(holder)) {
      return <AskFor resource={resource} holder={holder} kind={kind} name={name} />;
    }
    return (
      <button
        type="button"
        class={kind}
        aria-label={label(text.giveBack)}
        onClick={() => void giveBack()}
      >
        {text.giveBack}
      </button>
    );
  }
  return (
    <button
      type="button"
      class={kind}
      aria-label={label(text.take)}
      title={text.takeHint}
      onClick={() => void order({ verb: "take", resources: [resource] })}
    >
      {text.take}
    </button>
  );
}

interface AskForProps {
  resource: string;
  holder: string;
  kind: string;
  name?: string | undefined;
}

/** Another operator has it. */
function AskFor({ resource, holder, kind, name }: AskForProps) {
  const asked = requests.value.some((request) => request.resource === resource);
  return (
    <>
      <button
        type="button"
        class={kind}
        aria-label={name && `${strings.people.ask} ${name}`}
        title={fill(strings.people.askHint, { holder })}
        disabled={asked}
        onClick={() => void askFor(resource)}
      >
        {strings.people.ask}
      </button>
      <ForceGiveBack kind={kind} held={[{ resource, holder }]} />
    </>
  );
}
