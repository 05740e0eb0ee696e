// The requirements that stand in the mission's file: a list, of which one at a time is edited.
import { useState } from "preact/hooks";
import { useUniqueId } from "../../../shared/uniqueId";
import type { Requirement } from "../../moddle/requirements";
import { fill, strings } from "../../../strings";
import type { Finding } from "../../../shared/types";
import type { EditorContext } from "../panel";
import { Sign } from "../verify/Answers";
import { outcomeOf, type Answer, type Outcome } from "../verify/report";
import type { Verification } from "../verify/verification";
import { PATTERNS, spaced } from "./patterns";
import { RequirementForm } from "./RequirementForm";
import { add, change, placed, removeFrom, vocabularyOf, type Placed } from "./written";
import "./requirements.css";

const words = strings.requirements;

export interface RequirementsProps {
  editor: EditorContext;
  verification: Verification;
}

export function Requirements({ editor, verification }: RequirementsProps) {
  const [open, setOpen] = useState("");
  // Undone and redone changes are shown too.
  editor.changes.value;
  const all = placed(editor);
  const heading = useUniqueId();
  const vocabulary = vocabularyOf(editor);
  const taken = all.map(({ requirement }) => requirement.id);
  const changeTo = (one: Placed, next: Requirement) => {
    change(one, editor, next);
    if (next.id !== one.requirement.id) setOpen(next.id);
  };
  return (
    <section class="m2v-requirements" aria-labelledby={heading}>
      <h2 id={heading}>{words.title}</h2>
      {all.length === 0 && <p class="m2-note">{words.none}</p>}
      <ul>
        {all.map((one, index) => {
          const { requirement } = one;
          const isOpen = open === requirement.id;
          const findings = findingsOf(editor, verification, requirement.id);
          return (
            <li key={index} class={isOpen ? "m2v-requirement m2v-open" : "m2v-requirement"}>
              <Line
                one={one}
                isOpen={isOpen}
                answers={answersOf(verification, requirement.id)}
                strict={verification.made.value?.report.strict ?? false}
                isWrong={findings.length > 0}
                toggle={() => setOpen(isOpen ? "" : requirement.id)}
                remove={() => removeFrom(one, editor)}
              />
              {isOpen && (
                <RequirementForm
                  editor={editor}
                  vocabulary={vocabulary}
                  prefix={`m2v-requirement-${index}`}
                  requirement={requirement}
                  isTaken={taken.filter((id) => id === requirement.id).length > 1}
                  findings={findings}
                  write={(next) => changeTo(one, next)}
                />
              )}
            </li>
          );
        })}
      </ul>
      <Adding
        add={(pattern) => {
          const id = add(editor, pattern);
          if (id) setOpen(id);
        }}
      />
    </section>
  );
}

const OF_CHECK = "requirement";

/** What the check of the drawing found, and what it leaves to a verification. */
function findingsOf(editor: EditorContext, verification: Verification, id: string): Finding[] {
  const refused = verification.job.refusal.value?.findings ?? [];
  const all = [
    ...editor.checks.findings.value.filter(({ rule }) => rule === OF_CHECK),
    ...refused.filter(({ rule }) => rule !== OF_CHECK),
  ];
  return all.filter(({ element }) => element === id);
}

/** One, or one for each vehicle. */
function answersOf(verification: Verification, id: string): Answer[] {
  if (verification.isStale.value) return [];
  const all = verification.made.value?.report.properties ?? [];
  return all.filter(
    ({ required, property }) => required && (property === id || property.startsWith(`${id}/`)),
  );
}

interface LineProps {
  one: Placed;
  isOpen: boolean;
  isWrong: boolean;
  answers: readonly Answer[];
  strict: boolean;
  toggle(): void;
  remove(): void;
}

const WORST: readonly Outcome[] = ["violated", "warning", "undecided", "holds"];

function Line({ one, isOpen, isWrong, answers, strict, toggle, remove }: LineProps) {
  const { id, text, ltl, pattern } = one.requirement;
  const outcomes = answers.map((answer) => outcomeOf(answer, strict));
  const worst = isWrong ? "violated" : WORST.find((each) => outcomes.includes(each));
  return (
    <div class="m2v-requirement-line">
      <button type="button" class="m2v-requirement-head" aria-expanded={isOpen} onClick={toggle}>
        {worst && <Sign outcome={worst} />}
        <span>
          <b>{id || words.unnamed}</b>
          {worst && (
            <span class="m2v-hidden">
              {isWrong ? words.unusable : strings.verify.outcomes[worst]}
            </span>
          )}
          <span class="m2v-said">{text || (ltl ?? spaced(pattern)) || words.empty}</span>
          {answers.map(({ property, says, condition }) => (
            <span key={property} class="m2v-english">
              {says}
              {condition && <span class="m2v-condition">{condition}</span>}
            </span>
          ))}
        </span>
      </button>
      <button
        type="button"
        class="m2-icon-button"
        aria-label={fill(words.remove, { id })}
        title={fill(words.remove, { id })}
        onClick={remove}
      >
        ×
      </button>
    </div>
  );
}

function Adding({ add: addOne }: { add(pattern: string): void }) {
  const [pattern, setPattern] = useState("existence");
  const groups = [...new Set(PATTERNS.map(({ group }) => group))];
  const meaning = PATTERNS.find(({ name }) => name === pattern)?.meaning;
  return (
    <div class="m2v-adding">
      <select
        class="m2-input"
        aria-label={words.pattern}
        value={pattern}
        onChange={(event) => setPattern(event.currentTarget.value)}
      >
        <option value="">{words.formula}</option>
        {groups.map((group) => (
          <optgroup key={group} label={group}>
            {PATTERNS.filter((each) => each.group === group).map(({ name }) => (
              <option key={name} value={name}>
                {spaced(name)}
              </option>
            ))}
          </optgroup>
        ))}
      </select>
      <button type="button" class="secondary" onClick={() => addOne(pattern)}>
        {words.add}
      </button>
      <p class="m2-field-hint">{meaning ?? words.formulaHint}</p>
    </div>
  );
}
