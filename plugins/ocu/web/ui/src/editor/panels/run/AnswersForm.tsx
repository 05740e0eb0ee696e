// What operators, services, vehicles and the outside do in a rehearsal, as a form; or as YAML.
import { fill, strings } from "../../../strings";
import { SelectField } from "../../properties/fields/SelectField";
import { TextField } from "../../properties/fields/TextField";
import { Rows } from "../../properties/forms/Rows";
import { askingTasks, type AskingTask } from "../drawn";
import type { EditorContext } from "../panel";
import { dataOf, isSeconds, yamlOf, type Script, type ScriptedAnswer } from "./answers";
import type { Rehearsal } from "./rehearsal";
import { Behaviors, Services } from "./ScriptedTasks";
import { Seconds } from "./Seconds";

const words = strings.run.answers;

export interface AnswersFormProps {
  editor: EditorContext;
  rehearsal: Rehearsal;
}

export function AnswersForm({ editor, rehearsal }: AnswersFormProps) {
  // Tasks come and go while the mission is drawn.
  editor.changes.value;
  const raw = rehearsal.raw.value;
  const file = rehearsal.file.value;
  const unread = rehearsal.unread.value;
  const script = rehearsal.script.value;
  const write = (next: Partial<Script>) => {
    rehearsal.script.value = { ...script, ...next };
  };
  if (raw !== null) {
    return (
      <>
        <TextField
          id="m2r-yaml"
          label={words.yaml}
          hint={file ? fill(words.ofFile, { file }) : words.yamlHint}
          rows={10}
          mono
          value={raw}
          write={(text) => rehearsal.write(text)}
        />
        <button type="button" class="m2-button" onClick={() => void rehearsal.readBack(editor)}>
          {words.toForm}
        </button>
        {unread !== null && (
          <p class="m2-field-error" role="alert">
            {fill(words.unread.stays, { reason: unread })}
          </p>
        )}
      </>
    );
  }
  const part = { editor, script, write };
  return (
    <>
      <Decisions {...part} />
      <Sends {...part} />
      <Services {...part} />
      <Behaviors {...part} />
      <TextField
        id="m2r-more"
        label={words.more}
        hint={words.moreHint}
        rows={3}
        mono
        value={script.more}
        write={(more) => write({ more })}
      />
      <button
        type="button"
        class="m2-button"
        disabled={!rehearsal.isReady.value}
        onClick={() => rehearsal.write(yamlOf(script))}
      >
        {words.toYaml}
      </button>
    </>
  );
}

export interface PartProps {
  editor: EditorContext;
  script: Script;
  write(next: Partial<Script>): void;
}

function Decisions({ editor, script, write }: PartProps) {
  const tasks = askingTasks(editor);
  if (tasks.length === 0) return null;
  return (
    <fieldset class="m2v-list">
      <legend>{words.decisions}</legend>
      {tasks.map((task) => (
        <Visits
          key={task.id}
          task={task}
          visits={script.answers[task.id] ?? []}
          write={(visits) => write({ answers: { ...script.answers, [task.id]: visits } })}
        />
      ))}
    </fieldset>
  );
}

interface VisitsProps {
  task: AskingTask;
  visits: readonly ScriptedAnswer[];
  write(visits: readonly ScriptedAnswer[]): void;
}

/** The decisions at one user task, visit by visit. */
function Visits({ task, visits, write }: VisitsProps) {
  const name = task.name || task.id;
  const first = task.decisions[0]?.value ?? "";
  return (
    <div class="m2r-visits" role="group" aria-label={name}>
      <b>{name}</b>
      {visits.length === 0 && (
        <p class="m2-field-hint">
          {first ? fill(words.takesFirst, { decision: first }) : words.noDecisions}
        </p>
      )}
      <div>
        {visits.map((visit, index) => (
          <Visit
            key={index}
            task={task}
            number={index + 1}
            visit={visit}
            write={(next) => write(visits.with(index, next))}
          />
        ))}
        {task.decisions.length > 0 && (
          <button
            type="button"
            class="m2-button"
            onClick={() => write([...visits, { decision: first, after: "" }])}
          >
            {words.addVisit}
            <span class="m2v-hidden">{fill(words.of, { name })}</span>
          </button>
        )}
        {visits.length > 0 && (
          <button
            type="button"
            class="m2-icon-button"
            aria-label={fill(words.removeVisit, { name })}
            title={fill(words.removeVisit, { name })}
            onClick={() => write(visits.slice(0, -1))}
          >
            ×
          </button>
        )}
      </div>
    </div>
  );
}

interface VisitProps {
  task: AskingTask;
  number: number;
  visit: ScriptedAnswer;
  write(visit: ScriptedAnswer): void;
}

function Visit({ task, number, visit, write }: VisitProps) {
  const { decision, after } = visit;
  const name = task.name || task.id;
  const isTimed = after.trim() === "" || isSeconds(after);
  return (
    <div class="m2r-visit">
      <select
        class="m2-input"
        aria-label={fill(words.visit, { name, number })}
        value={decision}
        onChange={(event) => write({ ...visit, decision: event.currentTarget.value })}
      >
        {!task.decisions.some(({ value }) => value === decision) && (
          <option value={decision}>{decision}</option>
        )}
        {task.decisions.map(({ value, label }) => (
          <option key={value} value={value}>
            {number}. {label}
          </option>
        ))}
      </select>
      <input
        type="text"
        class="m2-input"
        inputMode="decimal"
        autocomplete="off"
        aria-label={fill(words.visitAfter, { name, number })}
        aria-invalid={!isTimed}
        title={isTimed ? words.visitAfterHint : words.seconds}
        placeholder={words.atOnce}
        value={after}
        onInput={(event) => write({ ...visit, after: event.currentTarget.value })}
      />
    </div>
  );
}

function Sends({ editor, script, write }: PartProps) {
  const { signals = [], messages = [] } = editor.checks.outline.value ?? {};
  const options = [
    ...signals.map((each) => ({ ...each, kind: "signal" as const, group: words.signals })),
    ...messages.map((each) => ({ ...each, kind: "message" as const, group: words.messages })),
  ];
  if (options.length === 0 && script.sends.length === 0) return null;
  return (
    <fieldset class="m2v-list">
      <legend>{words.sends}</legend>
      <Rows
        rows={script.sends}
        write={(sends) => write({ sends })}
        add={() => ({
          kind: options[0]?.kind ?? "signal",
          id: options[0]?.id ?? "",
          at: "",
          data: "",
        })}
        addLabel={words.addSend}
        empty={words.nothing}
        label={(row, index) => options.find(({ id }) => id === row.id)?.name || String(index + 1)}
        render={(row, index) => {
          const change = (next: Partial<typeof row>) =>
            write({ sends: script.sends.with(index, { ...row, ...next }) });
          return (
            <>
              <SelectField
                id={`m2r-send-${index}`}
                label={words.what}
                value={row.id}
                options={options.map(({ id, name, group }) => ({
                  value: id,
                  label: name || id,
                  group,
                }))}
                write={(id) =>
                  change({ id, kind: options.find((each) => each.id === id)?.kind ?? row.kind })
                }
              />
              <Seconds
                id={`m2r-send-at-${index}`}
                label={words.at}
                value={row.at}
                required
                write={(at) => change({ at })}
              />
              <TextField
                id={`m2r-send-data-${index}`}
                label={words.data}
                hint={words.dataHint}
                mono
                value={row.data}
                error={dataOf(row.data) ? undefined : words.dataWrong}
                write={(data) => change({ data })}
              />
            </>
          );
        }}
      />
    </fieldset>
  );
}
