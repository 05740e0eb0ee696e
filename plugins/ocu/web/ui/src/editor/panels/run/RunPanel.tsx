// Run: the mission is rehearsed as it is drawn, or saved and started.
import { useRef, useState } from "preact/hooks";
import { Approval } from "../../../people/Approval";
import { Dialog } from "../../../shared/Dialog";
import { go } from "../../../shared/router";
import { may, session } from "../../../shared/session";
import { loaded } from "../../../shared/loaded";
import { fill, strings } from "../../../strings";
import { beginningOf } from "../begin/beginning";
import { BeginForm } from "../begin/BeginForm";
import type { EditorContext, Panel } from "../panel";
import { ProblemView } from "../ProblemView";
import { BusyDialog } from "./BusyDialog";
import { AnswersForm } from "./AnswersForm";
import { rehearsalOf } from "./rehearsal";
import { startingOf } from "./starting";
import "../begin/begin.css";
import "../verify/verify.css";
import "./run.css";

const words = strings.run;

/** Who only draws needs nothing of it. */
const Outcome = loaded(() => import("./Outcome"));

export const runPanel: Panel = {
  id: "run",
  title: words.title,
  render: (editor) => <RunPanel editor={editor} />,
};

function RunPanel({ editor }: { editor: EditorContext }) {
  return (
    <div class="m2v">
      <section aria-label={words.begins}>
        <h2>{words.begins}</h2>
        <BeginForm editor={editor} prefix="m2r" />
      </section>
      <Rehearse editor={editor} />
      {editor.catalogue.fleet.approval_persons > 0 && (
        <Approval mission={editor.mission} isDirty={editor.isDirty.value} />
      )}
      <Start editor={editor} />
    </div>
  );
}

function Rehearse({ editor }: { editor: EditorContext }) {
  const rehearsal = rehearsalOf(editor);
  const { job } = rehearsal;
  const file = useRef<HTMLInputElement>(null);
  const busy = job.isBusy.value;
  const allowed = may("operator");
  const begins = beginningOf(editor).isReadable();
  const ready = begins && rehearsal.isReady.value;
  const told = job.told.value;
  const refusal = job.refusal.value;
  return (
    <section class="m2r-part" aria-label={words.rehearse}>
      <h2>{words.rehearse}</h2>
      <p class="m2-field-hint">{words.rehearseHint}</p>
      <details
        class="m2v-options"
        open={rehearsal.isUnfolded.value}
        onToggle={(event) => (rehearsal.isUnfolded.value = event.currentTarget.open)}
      >
        <summary>{words.answers.title}</summary>
        <AnswersForm editor={editor} rehearsal={rehearsal} />
      </details>
      <div class="m2v-actions">
        {allowed && (
          <button
            type="button"
            class="primary"
            disabled={busy || !ready || !editor.isOpen.value}
            onClick={() => void rehearsal.begin(editor)}
          >
            {words.rehearse}
          </button>
        )}
        {allowed && (
          <>
            <button
              type="button"
              class="secondary"
              title={words.answers.chooseHint}
              disabled={busy || !begins || !editor.isOpen.value}
              onClick={() => file.current?.click()}
            >
              {words.answers.choose}
            </button>
            <input
              ref={file}
              type="file"
              accept=".yaml,.yml"
              hidden
              aria-label={words.answers.choose}
              onChange={({ currentTarget: input }) => {
                const [chosen] = input.files ?? [];
                if (chosen) void rehearsal.open(editor, chosen);
                input.value = "";
              }}
            />
          </>
        )}
        {busy && (
          <button type="button" class="secondary" onClick={() => void job.cancel()}>
            {strings.verify.cancel}
          </button>
        )}
      </div>
      {!allowed && <p class="m2-note">{words.rehearseNotAllowed}</p>}
      {!ready && <p class="m2-note">{words.notReady}</p>}
      <div role="status">
        {busy && (
          <div class="m2v-progress">
            <span class="m2v-spinner" aria-hidden="true" />
            {words.rehearsing}
          </div>
        )}
        {told?.state === "cancelled" && <p class="m2-note">{words.cancelled}</p>}
        {told?.summary && (
          <Outcome
            editor={editor}
            id={job.id.value}
            summary={told.summary}
            read={rehearsal.read.value}
          />
        )}
      </div>
      {refusal && (
        <ProblemView
          editor={editor}
          title={words.failed}
          refusal={refusal}
          typed={{ file: "answers.yaml", text: rehearsal.sent.value }}
        />
      )}
    </section>
  );
}

function Start({ editor }: { editor: EditorContext }) {
  const [asks, setAsks] = useState(false);
  const starting = startingOf(editor);
  const simulated = session.value?.simulated ?? false;
  const allowed = may("commander");
  const ready = beginningOf(editor).isReadable();
  const busy = starting.isBusy.value;
  const refusal = starting.refusal.value;
  const busyNow = starting.busy.value;
  const start = async (evenIfBusy = false) => {
    setAsks(false);
    const run = await starting.start(editor, evenIfBusy);
    if (run !== undefined) go(`/runs/${encodeURIComponent(run)}`);
  };
  return (
    <section class="m2r-part" aria-label={words.start}>
      <h2>{words.start}</h2>
      <p class="m2-field-hint">{simulated ? words.startSimulated : words.startReal}</p>
      <div class="m2v-actions">
        {allowed && (
          <button
            type="button"
            class={simulated ? "primary" : "primary m2r-real"}
            disabled={busy || !ready || !editor.isOpen.value}
            onClick={() => (simulated ? void start() : setAsks(true))}
          >
            {busy ? words.starting : simulated ? words.start : words.startRealButton}
          </button>
        )}
      </div>
      {!allowed && <p class="m2-note">{words.startNotAllowed}</p>}
      {refusal && <ProblemView editor={editor} title={words.startFailed} refusal={refusal} />}
      {busyNow && (
        <BusyDialog
          mission={editor.mission}
          busy={busyNow}
          real={!simulated}
          startNow={(evenIfBusy) => void start(evenIfBusy)}
          close={() => (starting.busy.value = null)}
        />
      )}
      {asks && (
        <Dialog
          title={words.real.title}
          onClose={() => setAsks(false)}
          actions={
            <>
              <button type="button" class="secondary" onClick={() => setAsks(false)}>
                {words.real.no}
              </button>
              <button type="button" class="primary m2r-real" onClick={() => void start()}>
                {words.real.yes}
              </button>
            </>
          }
        >
          <p>
            <strong>{words.real.moves}</strong>
          </p>
          <p>
            {fill(words.real.text, { fleet: session.value?.fleet ?? "", mission: editor.mission })}
          </p>
        </Dialog>
      )}
    </section>
  );
}
