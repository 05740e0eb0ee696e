// The report: what holds, what does not, and up to what.
import { useEffect, useRef } from "preact/hooks";
import { fill, strings } from "../../../strings";
import type { EditorContext } from "../panel";
import { Assumed } from "./Assumed";
import { counted, tell, type Outcome, type Report, type Told } from "./report";
import type { Verification } from "./verification";
import { locale } from "../../../strings/language";

const words = strings.verify;
const NUMBER = new Intl.NumberFormat(locale);

interface PartProps {
  editor: EditorContext;
  verification: Verification;
}

export function Answers({ editor, verification }: PartProps) {
  const made = verification.made.value;
  if (!made) return null;
  const { report } = made;
  const stale = verification.isStale.value;
  const required = tell(report, true);
  return (
    <section class={stale ? "m2v-report m2v-stale" : "m2v-report"} aria-label={words.report}>
      <div role="status">
        {stale && <p class="m2v-stale-note">{words.stale}</p>}
        <Summary report={report} />
      </div>
      <Assumed report={report} inOrder={verification.inOrder.value} />
      {required.length > 0 && (
        <AnswerList title={words.requirements} told={required} verification={verification} />
      )}
      <AnswerList title={words.properties} told={tell(report, false)} verification={verification} />
      <Unreached editor={editor} report={report} />
      <Approximations editor={editor} report={report} />
      <button type="button" class="secondary m2v-clear" onClick={() => verification.clear()}>
        {words.clear}
      </button>
    </section>
  );
}

function Summary({ report }: { report: Report }) {
  const counts = counted(report);
  const { states, transitions, seconds, stopped, notes } = report.coverage;
  const said = (["violated", "warning", "undecided", "holds"] as const).filter(
    (each) => counts[each],
  );
  return (
    <div class={`m2v-summary m2v-${report.verdict}`}>
      <h2>
        <Sign outcome={report.verdict} />
        {words.verdicts[report.verdict]}
      </h2>
      <p>{said.map((each) => fill(words.counts[each], { count: counts[each] })).join(", ")}</p>
      <p class="m2v-faint">
        {fill(stopped ? words.searchedPart : words.searched, {
          states: NUMBER.format(states),
          steps: NUMBER.format(transitions),
          seconds: seconds < 0.1 ? words.moment : `${NUMBER.format(Number(seconds.toFixed(1)))} s`,
        })}
      </p>
      {stopped && <p>{fill(words.stopped, { reason: stopped })}</p>}
      {notes.map((note) => (
        <p key={note} class="m2v-faint">
          {note}
        </p>
      ))}
    </div>
  );
}

const SIGNS: Record<Outcome, string> = { holds: "✓", violated: "✗", warning: "!", undecided: "?" };

export function Sign({ outcome }: { outcome: Outcome }) {
  return (
    <span class={`m2v-sign m2v-sign-${outcome}`} aria-hidden="true">
      {SIGNS[outcome]}
    </span>
  );
}

interface AnswerListProps {
  title: string;
  told: readonly Told[];
  verification: Verification;
}

function AnswerList({ title, told, verification }: AnswerListProps) {
  const bad = told.filter(({ outcome }) => outcome !== "holds");
  const good = told.filter(({ outcome }) => outcome === "holds");
  const isPointed = good.some(({ answer }) => answer.property === verification.pointed.value);
  const shown = (each: Told) => (
    <AnswerLine key={each.answer.property} told={each} verification={verification} />
  );
  return (
    <>
      <h2>{title}</h2>
      {bad.length > 0 && <ul class="m2v-answers">{bad.map(shown)}</ul>}
      {good.length > 0 && (
        <details open={bad.length === 0 || isPointed}>
          <summary>{fill(words.counts.holds, { count: good.length })}</summary>
          <ul class="m2v-answers">{good.map(shown)}</ul>
        </details>
      )}
    </>
  );
}

function AnswerLine({ told, verification }: { told: Told; verification: Verification }) {
  const { answer, outcome, violations } = told;
  // Where it is violated in either case, one run is enough.
  const without = outcome === "holds" ? answer.without?.violation : undefined;
  const line = useRef<HTMLLIElement>(null);
  const isPointed = verification.pointed.value === answer.property;
  useEffect(() => {
    if (isPointed) line.current?.scrollIntoView({ block: "center" });
  }, [isPointed]);
  return (
    <li ref={line} class={isPointed ? "m2v-pointed" : undefined}>
      <Sign outcome={outcome} />
      <div>
        <p>
          <span class="m2v-name">{answer.property}</span>{" "}
          <span class={`m2v-outcome m2v-outcome-${outcome}`}>{words.outcomes[outcome]}</span>
        </p>
        {answer.author && <p class="m2v-author">“{answer.author}”</p>}
        <p>{answer.says}</p>
        {answer.condition && <p class="m2v-condition">{answer.condition}</p>}
        {answer.note && <p class="m2v-faint">{answer.note}</p>}
        {without && (
          <button type="button" class="m2v-violation" onClick={() => verification.open(without)}>
            <span>{without.text}</span>
            <span class="m2v-show">
              {fill(words.showRunWithout, { count: without.steps.length + without.loop.length })}
            </span>
          </button>
        )}
        {violations.map((violation, index) => (
          <button
            key={index}
            type="button"
            class="m2v-violation"
            onClick={() => verification.open(violation)}
          >
            <span>{violation.text}</span>
            <span class="m2v-show">
              {violation.steps.length + violation.loop.length > 0
                ? fill(words.showRun, { count: violation.steps.length + violation.loop.length })
                : words.showPlace}
            </span>
          </button>
        ))}
      </div>
    </li>
  );
}

function Unreached({ editor, report }: { editor: EditorContext; report: Report }) {
  if (report.unreached.length === 0) return null;
  return (
    <>
      <h2>{words.unreached}</h2>
      <p class="m2v-faint">{words.unreachedHint}</p>
      <ul class="m2v-chips">
        {report.unreached.map((id) => (
          <li key={id}>
            <ElementLink editor={editor} id={id} class="m2v-chip" />
          </li>
        ))}
      </ul>
    </>
  );
}

function Approximations({ editor, report }: { editor: EditorContext; report: Report }) {
  if (report.approximations.length === 0) return null;
  return (
    <>
      <h2>{words.approximations}</h2>
      <ul class="m2v-answers">
        {report.approximations.map(({ element, exactness, what }, index) => (
          <li key={index}>
            <span class="m2v-sign m2v-sign-undecided" aria-hidden="true">
              ≈
            </span>
            <div>
              <p>
                <ElementLink editor={editor} id={element} class="m2v-link" />: {what}
              </p>
              <p class="m2v-faint">{words.exactness[exactness]}</p>
            </div>
          </li>
        ))}
      </ul>
    </>
  );
}

interface ElementLinkProps {
  editor: EditorContext;
  id: string;
  class: string;
}

/** An element by its name; choosing it shows it on the diagram. */
export function ElementLink({ editor, id, class: className }: ElementLinkProps) {
  const name = editor.checks.outline.value?.elements.find((each) => each.id === id)?.name;
  return (
    <button type="button" class={className} title={id} onClick={() => void editor.select(id)}>
      {name || id}
    </button>
  );
}
