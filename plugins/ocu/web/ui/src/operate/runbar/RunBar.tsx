// Which run is shown, its status, and what may be done with it as a whole.
import { useSignal } from "@preact/signals";
import { command } from "../../shared/command";
import { activeRuns } from "../../shared/executive";
import { clock, dateTime, grouped } from "../../shared/format";
import { listingVersions, revising } from "../../revise/revising";
import { go } from "../../shared/router";
import { titleOf } from "../../shared/runs";
import { may } from "../../shared/session";
import { StopButton } from "../../shared/StopButton";
import { stop } from "../../shared/stopping";
import { counted, fill, strings } from "../../strings";
import { useOperating } from "../context";
import { Icon } from "../layout/icons";
import { usePaced } from "../layout/pace";
import { showRequirements } from "../layout/chosenTabs";
import { isViolated, VIOLATION } from "../requirements/violations";
import { SendDialog } from "./SendDialog";
import "./runbar.css";

const text = strings.operate.run;

export function RunBar() {
  const { scene } = useOperating();
  const summary = scene.summary.value;
  const status = scene.status.value ?? summary?.status ?? "running";
  return (
    <div class="run-bar">
      <Runs shown={scene.run} />
      <span class={`status status-${status}`} role="status">
        {text.status[status]}
      </span>
      <strong class="mission-name" title={summary?.process}>
        {summary ? titleOf(summary) : ""}
      </strong>
      {scene.run && (
        <button
          type="button"
          class="secondary"
          title={strings.revise.versionsHint}
          onClick={() => (listingVersions.value = scene.run)}
        >
          {strings.revise.versions}
        </button>
      )}
      {scene.mode === "replay" && (
        <span class="mode">
          {scene.run ? text.replay : text.rehearsal}
          {scene.run && summary && ` · ${dateTime(summary.began_us)}`}
        </span>
      )}
      <Clock />
      <Violations />
      {status === "interrupted" && <em>{fill(text.interrupted, { run: scene.run })}</em>}
      <span class="space" />
      {scene.mode === "replay" && <Asked />}
      {scene.mode === "live" && <Controls status={status} />}
    </div>
  );
}

function Runs({ shown }: { shown: string }) {
  const others = activeRuns.value;
  if (others.length === 0 || (others.length === 1 && others[0]!.run === shown)) {
    return <span class="run-name">{shown}</span>;
  }
  return (
    <nav class="runs" aria-label={text.runs}>
      {others.map((run) => {
        const path = `/runs/${encodeURIComponent(run.run)}`;
        return (
          <a
            key={run.run}
            href={path}
            aria-current={run.run === shown ? "page" : undefined}
            title={titleOf(run)}
            onClick={(event) => {
              if (event.ctrlKey || event.metaKey || event.shiftKey) return;
              event.preventDefault();
              go(path);
            }}
          >
            {run.run} <small>{titleOf(run)}</small>
          </a>
        );
      })}
    </nav>
  );
}

/** In a replay: which question stood then. */
function Asked() {
  const { scene, selected } = useOperating();
  const [prompt] = scene.prompts.value;
  if (!prompt) return null;
  const { process, element, text: question } = prompt;
  return (
    <button
      type="button"
      class="asked"
      title={question}
      onClick={() => (selected.value = { process, element, show: true })}
    >
      ? {question}
    </button>
  );
}

/** Which requirements are violated: seen whatever else is open. */
function Violations() {
  const { scene } = useOperating();
  const count = Object.values(scene.requirements.value).filter(isViolated).length;
  return (
    <span role="status">
      {count > 0 && (
        <button
          type="button"
          class="violations"
          title={strings.monitors.open}
          onClick={showRequirements}
        >
          {VIOLATION} {counted(strings.monitors.violated, count)}
        </button>
      )}
    </span>
  );
}

function Clock() {
  const { scene } = useOperating();
  const time = usePaced(scene.time, 200);
  const events = usePaced(scene.events, 500);
  const pace = scene.pace.value;
  return (
    <>
      <span class="clock" title={text.time}>
        {clock(time)}
      </span>
      {scene.mode === "live" && pace !== 1 && (
        <span title={text.speed}>{Number(pace.toPrecision(3))}×</span>
      )}
      <span class="events">
        {grouped(events)} {text.events}
      </span>
    </>
  );
}

function Controls({ status }: { status: string }) {
  const { scene, replay } = useOperating();
  const sending = useSignal<"signal" | "message" | null>(null);
  const path = `/runs/${encodeURIComponent(scene.run)}`;
  const ask = (what: string) => void command(`${path}/${what}`);
  const goesOn = status === "running" || status === "paused";
  if (!goesOn && status !== "interrupted") {
    return (
      <button type="button" class="primary" onClick={replay}>
        {text.replay}
      </button>
    );
  }
  if (!may("operator")) return null;
  return (
    <>
      {status === "paused" ? (
        <button type="button" class="primary" disabled={!goesOn} onClick={() => ask("resume")}>
          <Icon name="play" />
          {text.resume}
        </button>
      ) : (
        <button
          type="button"
          class="secondary"
          title={text.pauseHint}
          disabled={!goesOn}
          onClick={() => ask("pause")}
        >
          <Icon name="pause" />
          {text.pause}
        </button>
      )}
      <button
        type="button"
        class="secondary"
        disabled={!goesOn}
        onClick={() => (sending.value = "signal")}
      >
        {text.signal}
      </button>
      <button
        type="button"
        class="secondary"
        disabled={!goesOn}
        onClick={() => (sending.value = "message")}
      >
        {text.message}
      </button>
      <button
        type="button"
        class="secondary"
        disabled={!goesOn}
        onClick={() => (revising.value = { run: scene.run, version: null })}
      >
        {strings.revise.open}
      </button>
      <StopButton
        class="stop-run"
        label={text.stopRun}
        again={fill(text.stopRunAgain, { run: scene.run })}
        hint={text.stopRun}
        disabled={!goesOn}
        onStop={() =>
          void stop(`${path}/stop`, fill(strings.shell.stopOneRun, { run: scene.run }))
        }
      />
      {sending.value && <SendDialog what={sending.value} onClose={() => (sending.value = null)} />}
    </>
  );
}
