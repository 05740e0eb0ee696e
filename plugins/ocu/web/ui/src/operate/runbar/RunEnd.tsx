// How a run ended, and why: said once, at its end.
import type { RunRecord } from "../../shared/types";
import { lineOf } from "../../records/logLine";
import { clock, grouped } from "../../shared/format";
import { Dialog } from "../../shared/Dialog";
import { strings } from "../../strings";
import { useOperating } from "../context";
import { isViolated, VIOLATION } from "../requirements/violations";

const text = strings.operate.end;

const MOST = 6;

type Ended = keyof typeof text;

export function RunEnd({ onClose }: { onClose: () => void }) {
  const { scene, replay } = useOperating();
  const summary = scene.summary.value;
  if (!summary) return null;
  const { records: logged } = scene.log.value;
  const records = scene.notable();
  const lines = (wanted: (record: RunRecord) => boolean) =>
    records
      .filter(wanted)
      .slice(-MOST)
      .map(lineOf);
  const violated = Object.entries(scene.requirements.value).filter(([, each]) => isViolated(each));
  const decisions = lines(({ record }) => record === "PromptAnswered");
  const faults = lines((record) => isFault(record));
  return (
    <Dialog
      title={text.title}
      onClose={onClose}
      actions={
        <>
          <button type="button" class="secondary" onClick={onClose}>
            {text.dismiss}
          </button>
          <button type="button" class="primary" onClick={replay}>
            {text.replay}
          </button>
        </>
      }
    >
      <p class="run-end">
        <strong class={`status status-${summary.status}`}>
          {strings.operate.run.status[summary.status]}
        </strong>{" "}
        {summary.run} {text[summary.status as Ended] ?? ""}
      </p>
      <dl class="facts">
        <dt>{text.reason}</dt>
        <dd>{summary.detail || text.none}</dd>
        <dt>{text.duration}</dt>
        <dd>{clock(logged.at(-1)?.t ?? scene.now())}</dd>
        <dt>{text.records}</dt>
        <dd>{grouped(scene.events.value)}</dd>
        {violated.length > 0 && (
          <>
            <dt>{strings.monitors.title}</dt>
            <dd>
              {violated.map(([id, { english }]) => (
                <div key={id}>
                  {VIOLATION} {strings.monitors.states.violated}: <strong>{id}</strong> {english}
                </div>
              ))}
            </dd>
          </>
        )}
        <dt>{text.decisions}</dt>
        <dd>{decisions.length === 0 ? text.none : decisions.map(said)}</dd>
        <dt>{text.faults}</dt>
        <dd>{faults.length === 0 ? text.none : faults.map(said)}</dd>
      </dl>
    </Dialog>
  );
}

const said = ({ seq, t, text: line }: { seq: number; t: number; text: string }) => (
  <div key={seq}>
    <small>{clock(t)}</small> {line}
  </div>
);

function isFault({ record, state, code }: RunRecord): boolean {
  if (record === "ErrorThrown") return true;
  if (record === "ServiceEnded") return Boolean(code);
  return record === "BehaviorEnded" && /FAILED|REJECTED|LOST/.test(String(state));
}
