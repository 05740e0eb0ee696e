// A run that breaks a property, step by step: in words here, and on the diagram.
import { useEffect, useRef } from "preact/hooks";
import { fill, strings } from "../../../strings";
import type { EditorContext } from "../panel";
import { Sign } from "./Answers";
import { outcomeOf, type Answer, type Step, type Violation } from "./report";
import type { Verification } from "./verification";
import { changedData, walkOf } from "./walk";

const words = strings.verify.walk;

export interface ViolationViewProps {
  editor: EditorContext;
  verification: Verification;
  violation: Violation;
}

export function ViolationView({ editor, verification, violation }: ViolationViewProps) {
  const walk = walkOf(violation);
  const at = verification.step.value;
  const last = walk.steps.length - 1;
  const back = useRef<HTMLButtonElement>(null);
  useEffect(() => back.current?.focus(), [violation]);
  useFollowing(editor, violation, at);
  const keyDown = (event: KeyboardEvent) => {
    // The slider moves by itself, and tells.
    if (event.target instanceof HTMLInputElement || event.altKey || event.ctrlKey) return;
    const next = { ArrowLeft: at - 1, ArrowUp: at - 1, ArrowRight: at + 1, ArrowDown: at + 1 };
    const to = { ...next, Home: 0, End: last }[event.key];
    if (to === undefined || last < 0) return;
    event.preventDefault();
    event.stopPropagation();
    verification.goTo(to);
  };
  return (
    <section
      class={verification.isStale.value ? "m2v-walk m2v-stale" : "m2v-walk"}
      aria-label={words.label}
      onKeyDown={keyDown}
    >
      <button
        type="button"
        ref={back}
        class="secondary"
        onClick={() => {
          verification.opened.value = null;
        }}
      >
        ← {words.back}
      </button>
      {verification.isStale.value && <p class="m2v-stale-note">{strings.verify.stale}</p>}
      <Head verification={verification} violation={violation} />
      {last >= 0 && <Stepper verification={verification} last={last} steps={walk.steps} at={at} />}
      <StepList
        verification={verification}
        steps={walk.steps.slice(0, walk.before)}
        offset={0}
        title={words.steps}
      />
      {violation.loop.length > 0 && (
        <div class="m2v-loop">
          <StepList
            verification={verification}
            steps={walk.steps.slice(walk.before)}
            offset={walk.before}
            title={`↻ ${words.loop}`}
          />
        </div>
      )}
      <Changed steps={changedData(walk, at)} />
    </section>
  );
}

/** The diagram scrolls, or changes, to where the step is. */
function useFollowing(editor: EditorContext, violation: Violation, at: number): void {
  useEffect(() => {
    const steps = walkOf(violation).steps;
    const step = steps[at];
    const isLast = at >= steps.length - 1;
    const shown = isLast ? (violation.elements[0] ?? step?.element) : step?.element;
    if (!shown) return;
    // What can be done with an element would hide the marks on it.
    void editor.select(shown).then(() => editor.service("selection").select(null));
  }, [editor, violation, at]);
}

function Head({ verification, violation }: Omit<ViolationViewProps, "editor">) {
  const report = verification.made.value?.report;
  const answer: Answer | undefined = report?.properties.find(
    (each) => each.property === violation.property && each.required === violation.required,
  );
  const isWithout = answer?.without?.violation === violation;
  const outcome =
    answer && report
      ? outcomeOf(isWithout ? { ...answer, verdict: "violated" } : answer, report.strict)
      : "violated";
  return (
    <>
      <h2>
        <Sign outcome={outcome} />
        {violation.property}
      </h2>
      {answer?.author && <p class="m2v-author">“{answer.author}”</p>}
      {answer && <p>{answer.says}</p>}
      {isWithout && <p>{fill(words.without, { assumed: answer.assumed })}</p>}
      <p class={outcome === "warning" ? "m2v-wrong m2v-wrong-warning" : "m2v-wrong"}>
        {violation.text}
      </p>
    </>
  );
}

interface StepperProps {
  verification: Verification;
  steps: readonly Step[];
  last: number;
  at: number;
}

function Stepper({ verification, steps, last, at }: StepperProps) {
  const said = fill(words.at, { step: at + 1, count: last + 1 });
  const buttons = [
    { label: words.first, text: "«", to: 0, disabled: at === 0 },
    { label: words.previous, text: "‹", to: at - 1, disabled: at === 0 },
    { label: words.next, text: "›", to: at + 1, disabled: at === last },
    { label: words.last, text: "»", to: last, disabled: at === last },
  ];
  return (
    <div class="m2v-stepper" role="group" aria-label={words.stepper}>
      {buttons.map(({ label, text, to, disabled }) => (
        <button
          key={label}
          type="button"
          class="m2-icon-button"
          aria-label={label}
          title={label}
          aria-disabled={disabled}
          onClick={() => verification.goTo(to)}
        >
          {text}
        </button>
      ))}
      <input
        type="range"
        min={0}
        max={last}
        value={at}
        aria-label={words.position}
        aria-valuetext={`${said}: ${steps[at]?.text ?? ""}`}
        onInput={(event) => verification.goTo(Number(event.currentTarget.value))}
      />
      <output>{said}</output>
    </div>
  );
}

interface StepListProps {
  verification: Verification;
  steps: readonly Step[];
  /** Of the first of these in the whole run. */
  offset: number;
  title: string;
}

function StepList({ verification, steps, offset, title }: StepListProps) {
  const list = useRef<HTMLOListElement>(null);
  const at = verification.step.value;
  useEffect(() => {
    list.current?.querySelector('[aria-current="step"]')?.scrollIntoView({ block: "nearest" });
  }, [at]);
  if (steps.length === 0) return null;
  return (
    <>
      <h3>{title}</h3>
      <ol class="m2v-steps" ref={list}>
        {steps.map((step, index) => {
          const position = offset + index;
          return (
            <li key={position} class={position > at ? "m2v-step-ahead" : ""}>
              <button
                type="button"
                tabIndex={position === at ? 0 : -1}
                aria-current={position === at ? "step" : undefined}
                onClick={() => verification.goTo(position)}
              >
                <span class="m2v-step-number">{step.step}</span>
                <span>{step.text}</span>
              </button>
            </li>
          );
        })}
      </ol>
    </>
  );
}

function Changed({ steps }: { steps: readonly [name: string, value: unknown][] }) {
  if (steps.length === 0) return null;
  return (
    <>
      <h3>{words.data}</h3>
      <dl class="m2v-changed">
        {steps.map(([name, value]) => (
          <div key={name}>
            <dt>{name}</dt>
            <dd>{JSON.stringify(value)}</dd>
          </div>
        ))}
      </dl>
    </>
  );
}
