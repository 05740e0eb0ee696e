// Verify: what is asked, how far it is, and what came of it.
import { useEffect, useRef } from "preact/hooks";
import { may } from "../../../shared/session";
import { fill, strings } from "../../../strings";
import { CheckField } from "../../properties/fields/SelectField";
import { TextField } from "../../properties/fields/TextField";
import { beginningOf } from "../begin/beginning";
import { BeginForm } from "../begin/BeginForm";
import type { EditorContext, Panel } from "../panel";
import { ProblemView } from "../ProblemView";
import { Requirements } from "../requirements/Requirements";
import { Answers } from "./Answers";
import { followOnCanvas } from "./canvas";
import { counted, type Outcome } from "./report";
import { verificationOf, type Verification } from "./verification";
import { ViolationView } from "./ViolationView";
import "../begin/begin.css";
import "./verify.css";
import "./canvas.css";
import { locale } from "../../../strings/language";

const words = strings.verify;

export const verifyPanel: Panel = {
  id: "verify",
  title: words.title,
  badge: (editor) => {
    const made = verificationOf(editor).made.value;
    return made ? counted(made.report).violated : 0;
  },
  render: (editor) => <VerifyPanel editor={editor} />,
};

function VerifyPanel({ editor }: { editor: EditorContext }) {
  const verification = verificationOf(editor);
  const top = useRef<HTMLDivElement>(null);
  useEffect(() => followOnCanvas(editor, verification), [editor, verification]);
  const opened = verification.opened.value;
  useEffect(() => top.current?.scrollIntoView({ block: "start" }), [opened]);
  return (
    <div class="m2v" ref={top}>
      {opened ? (
        <ViolationView editor={editor} verification={verification} violation={opened} />
      ) : (
        <>
          <Ask editor={editor} verification={verification} />
          <Progress editor={editor} verification={verification} />
          <Answers editor={editor} verification={verification} />
          <Requirements editor={editor} verification={verification} />
        </>
      )}
    </div>
  );
}

interface PartProps {
  editor: EditorContext;
  verification: Verification;
}

function Ask({ editor, verification }: PartProps) {
  const { job, strict, inOrder, exhaustive, spec, assume, allPools } = verification;
  const busy = job.isBusy.value;
  const allowed = may("operator");
  const ready = beginningOf(editor).isReadable();
  return (
    <section class="m2v-ask" aria-label={words.ask}>
      <div class="m2v-actions">
        {allowed && (
          <button
            type="button"
            class="primary"
            disabled={busy || !ready || !editor.isOpen.value}
            title={words.beginHint}
            onClick={() => void verification.begin(editor)}
          >
            {words.begin}
          </button>
        )}
        {busy && (
          <button type="button" class="secondary" onClick={() => void job.cancel()}>
            {words.cancel}
          </button>
        )}
      </div>
      {!allowed && <p class="m2-note">{words.notAllowed}</p>}
      <details class="m2v-options">
        <summary>{words.options}</summary>
        <BeginForm editor={editor} prefix="m2v" />
        <TextField
          id="m2v-assume"
          label={words.assume}
          hint={words.assumeHint}
          mono
          placeholder={words.assumeExample}
          value={assume.value}
          error={wrongAssumption(verification)}
          write={(value) => {
            assume.value = value;
          }}
        />
        <CheckField
          id="m2v-all-pools"
          label={words.allPools}
          hint={words.allPoolsHint}
          value={allPools.value}
          write={(value) => {
            allPools.value = value;
          }}
        />
        <CheckField
          id="m2v-in-order"
          label={words.inOrder}
          hint={words.inOrderHint}
          value={inOrder.value}
          write={(value) => {
            inOrder.value = value;
          }}
        />
        <CheckField
          id="m2v-strict"
          label={words.strict}
          hint={words.strictHint}
          value={strict.value}
          write={(value) => {
            strict.value = value;
          }}
        />
        <CheckField
          id="m2v-exhaustive"
          label={words.exhaustive}
          hint={words.exhaustiveHint}
          value={exhaustive.value}
          write={(value) => {
            exhaustive.value = value;
          }}
        />
        <TextField
          id="m2v-spec"
          label={words.spec}
          hint={words.specHint}
          rows={4}
          mono
          placeholder={words.specExample}
          value={spec.value}
          write={(value) => {
            spec.value = value;
          }}
        />
      </details>
    </section>
  );
}

const ORDER: readonly Outcome[] = ["violated", "warning", "undecided", "holds"];
/** What is wrong with the assumption of the whole check, as it was sent. */
function wrongAssumption({ job }: Verification): string | undefined {
  const findings = job.refusal.value?.findings ?? [];
  const wrong = findings.filter(({ rule, element }) => rule === "assumption" && element === "");
  return wrong.map(({ message, remedy }) => `${message}; ${remedy}`).join("\n") || undefined;
}

const NUMBER = new Intl.NumberFormat(locale);

/** How far the search is, or why there is no report. */
function Progress({ editor, verification }: PartProps) {
  const { job, spec } = verification;
  const told = job.told.value;
  const refusal = job.refusal.value;
  const { states = 0, waiting = 0, seconds = 0, memory_mb = 0 } = told?.progress ?? {};
  return (
    <>
      <div role="status">
        {job.isBusy.value && (
          <div class="m2v-progress">
            <span class="m2v-spinner" aria-hidden="true" />
            {states
              ? fill(words.progress, {
                  states: NUMBER.format(states),
                  waiting: NUMBER.format(waiting),
                  rate: NUMBER.format(Math.round(states / Math.max(seconds, 0.1))),
                  memory: NUMBER.format(Math.round(memory_mb)),
                  seconds: NUMBER.format(Math.round(seconds)),
                })
              : words.starting}
          </div>
        )}
        {told?.state === "cancelled" && <p class="m2-note">{words.cancelled}</p>}
      </div>
      {job.isBusy.value && <Decided decided={told?.progress.decided ?? {}} />}
      {refusal && (
        <ProblemView
          editor={editor}
          title={words.failed}
          refusal={refusal}
          typed={{ file: "requirements.yaml", text: spec.value }}
        />
      )}
    </>
  );
}

/** What is certain while the search goes on, what is violated first. */
function Decided({ decided }: { decided: Record<string, Outcome> }) {
  const found = Object.entries(decided).sort(([, a], [, b]) => ORDER.indexOf(a) - ORDER.indexOf(b));
  if (!found.length) return null;
  return (
    <ul class="m2v-decided" aria-label={words.decided}>
      {found.map(([property, outcome]) => (
        <li key={property} data-outcome={outcome}>
          {words.outcomes[outcome]}: {property}
        </li>
      ))}
    </ul>
  );
}
