// What a revision would do, before it is done: what is refused and vehicles first.
import type { Finding } from "../shared/types";
import { fill, strings } from "../strings";
import { shortOf, vehiclesFirst, type Choice, type Moves, type Plan } from "./plan";

const words = strings.revise;

/** Of a choice that was not made yet. */
const NO_CHOICE = "\u0000";

export interface PlanViewProps {
  plan: Plan;
  choices: readonly Choice[];
  moves: Moves;
  /** `target` undefined: the token is not moved. */
  move(element: string, target: string | undefined): void;
  /** Show both diagrams. */
  compare(): void;
}

export function PlanView({ plan, choices, moves, move, compare }: PlanViewProps) {
  const from = { previous: shortOf(plan.previous), version: shortOf(plan.version) };
  return (
    <>
      <p title={plan.version}>{fill(words.fromTo, from)}</p>
      <div class="rev-plan">
        <div>
          {plan.refusals.length > 0 && (
            <section aria-label={words.refused} class="rev-bad">
              <h3>{words.refused}</h3>
              <ul>
                {vehiclesFirst(plan.refusals).map((each) => (
                  <li key={`${each.element} ${each.token} ${each.text}`}>
                    <Vehicles names={each.resources} />
                    {each.text}
                  </li>
                ))}
              </ul>
            </section>
          )}
          {choices.length > 0 && (
            <section aria-label={words.moves}>
              <h3>{words.moves}</h3>
              {choices.map((choice) => (
                <Move key={choice.element} choice={choice} moves={moves} move={move} />
              ))}
            </section>
          )}
          {(plan.effects.length > 0 || plan.refusals.length === 0) && (
            <section aria-label={words.becomes}>
              <h3>{words.becomes}</h3>
              {plan.effects.length === 0 && <p>{words.stays}</p>}
              <ul>
                {vehiclesFirst(plan.effects).map((each) => (
                  <li key={`${each.kind} ${each.element} ${each.token} ${each.text}`}>
                    <Vehicles names={each.resources} />
                    <span class="rev-kind">{words.kinds[each.kind] ?? each.kind}</span>: {each.text}
                  </li>
                ))}
              </ul>
            </section>
          )}
          {plan.busy.length > 0 && (
            <section aria-label={words.busy}>
              <h3>{words.busy}</h3>
              <ul>
                {plan.busy.map((each) => (
                  <li key={each}>{each}</li>
                ))}
              </ul>
            </section>
          )}
          {plan.outlook && (
            <section aria-label={words.follows}>
              <h3>{words.follows}</h3>
              <p>{plan.outlook.text}</p>
              {plan.outlook.requirements.length > 0 && (
                <ul>
                  {plan.outlook.requirements.map((each) => (
                    <li
                      key={each.requirement}
                      title={each.english}
                      class={each.verdict === "will be violated" ? "rev-bad" : ""}
                    >
                      {each.text}
                    </li>
                  ))}
                </ul>
              )}
            </section>
          )}
        </div>
        <div>
          {plan.approval && (
            <section aria-label={words.approval} class="rev-bad">
              <h3>{words.approval}</h3>
              <p>{plan.approval}</p>
            </section>
          )}
          {plan.findings.length > 0 && (
            <section aria-label={words.findings}>
              <h3>{words.findings}</h3>
              <Findings found={plan.findings} />
            </section>
          )}
          <section aria-label={words.differs}>
            <h3>{words.differs}</h3>
            {plan.changes.length === 0 && <p>{words.nothingDiffers}</p>}
            <ul>
              {plan.changes.map((each) => (
                <li key={each}>{each}</li>
              ))}
            </ul>
            <button type="button" class="secondary" onClick={compare}>
              {words.compare}
            </button>
          </section>
        </div>
      </div>
    </>
  );
}

function Vehicles({ names }: { names: readonly string[] }) {
  return (
    <>
      {names.map((name) => (
        <strong key={name} class="rev-vehicle">
          {name}
        </strong>
      ))}
    </>
  );
}

interface MoveProps {
  choice: Choice;
  moves: Moves;
  move(element: string, target: string | undefined): void;
}

function Move({ choice: { element, targets, canEnd }, moves, move }: MoveProps) {
  return (
    <label class="rev-move">
      {fill(words.moveOf, { element })}{" "}
      <select
        value={moves[element] ?? NO_CHOICE}
        onChange={({ currentTarget: { value } }) =>
          move(element, value === NO_CHOICE ? undefined : value)
        }
      >
        <option value={NO_CHOICE}>{words.move}</option>
        {targets.map(({ id, label }) => (
          <option key={id} value={id}>
            {fill(words.moveTo, { element: label })}
          </option>
        ))}
        {canEnd && <option value="">{words.moveEnd}</option>}
      </select>
    </label>
  );
}

export function Findings({ found }: { found: readonly Finding[] }) {
  return (
    <ul>
      {found.map(({ severity, line, element, message, remedy }, at) => (
        <li key={at}>
          <span class="rev-kind">{words.severities[severity]}</span>
          {line > 0 && <> ({fill(words.line, { line })})</>}: {element && <b>{element}</b>}{" "}
          {message} {remedy}
        </li>
      ))}
    </ul>
  );
}
