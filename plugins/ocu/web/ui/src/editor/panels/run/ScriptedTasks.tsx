// What services and vehicles do in a rehearsal, visit by visit.
import { strings } from "../../../strings";
import { SelectField } from "../../properties/fields/SelectField";
import { TextField } from "../../properties/fields/TextField";
import { Rows } from "../../properties/forms/Rows";
import { commandingTasks, servingTasks, type Task } from "../drawn";
import {
  carriesError,
  ENDS,
  hasTime,
  isFactor,
  isGiven,
  type ScriptedBehavior,
} from "./answers";
import type { PartProps } from "./AnswersForm";
import { Seconds } from "./Seconds";

const words = strings.run.answers;

const optionsOf = (tasks: readonly Task[]) =>
  tasks.map(({ id, name }) => ({ value: id, label: name || id }));
const nameOf = (tasks: readonly Task[], element: string) =>
  tasks.find(({ id }) => id === element)?.name || element;

export function Services({ editor, script, write }: PartProps) {
  const tasks = servingTasks(editor);
  if (tasks.length === 0 && script.services.length === 0) return null;
  return (
    <fieldset class="m2v-list">
      <legend>{words.services}</legend>
      <Rows
        rows={script.services}
        write={(services) => write({ services })}
        add={() => ({
          element: tasks[0]?.id ?? "",
          after: "5",
          name: "detection.type",
          value: "",
          error: "",
        })}
        addLabel={words.addService}
        empty={words.serviceUsual}
        label={(row) => nameOf(tasks, row.element)}
        render={(row, index) => {
          const change = (next: Partial<typeof row>) =>
            write({ services: script.services.with(index, { ...row, ...next }) });
          const id = `m2r-service-${index}`;
          return (
            <>
              <SelectField
                id={id}
                label={words.task}
                value={row.element}
                options={optionsOf(tasks)}
                write={(element) => change({ element })}
              />
              <Seconds
                id={`${id}-after`}
                label={words.after}
                value={row.after}
                write={(after) => change({ after })}
              />
              <TextField
                id={`${id}-name`}
                label={words.writes}
                mono
                value={row.name}
                write={(name) => change({ name })}
              />
              <TextField
                id={`${id}-value`}
                label={words.value}
                mono
                value={row.value}
                error={isGiven(row) ? undefined : words.valueNeeded}
                write={(value) => change({ value })}
              />
              <TextField
                id={`${id}-error`}
                label={words.orError}
                mono
                value={row.error}
                write={(error) => change({ error })}
              />
            </>
          );
        }}
      />
    </fieldset>
  );
}

const NEW: ScriptedBehavior = { element: "", after: "5", factor: "", end: "failed", error: "" };

export function Behaviors({ editor, script, write }: PartProps) {
  const tasks = commandingTasks(editor);
  if (tasks.length === 0 && script.behaviors.length === 0) return null;
  return (
    <fieldset class="m2v-list">
      <legend>{words.behaviors}</legend>
      <Rows
        rows={script.behaviors}
        write={(behaviors) => write({ behaviors })}
        add={() => ({ ...NEW, element: tasks[0]?.id ?? "" })}
        addLabel={words.addBehavior}
        empty={words.behaviorUsual}
        label={(row) => nameOf(tasks, row.element)}
        render={(row, index) => {
          const change = (next: Partial<typeof row>) =>
            write({ behaviors: script.behaviors.with(index, { ...row, ...next }) });
          const id = `m2r-behavior-${index}`;
          return (
            <>
              <SelectField
                id={id}
                label={words.task}
                value={row.element}
                options={optionsOf(tasks)}
                write={(element) => change({ element })}
              />
              <SelectField
                id={`${id}-end`}
                label={words.end}
                value={row.end}
                options={ENDS.map((end) => ({ value: end, label: words.ends[end] }))}
                write={(end) => change({ end: ENDS.find((each) => each === end) ?? row.end })}
              />
              {hasTime(row.end) ? (
                <Seconds
                  id={`${id}-after`}
                  label={words.after}
                  value={row.after}
                  required
                  write={(after) => change({ after })}
                />
              ) : (
                <TextField
                  id={`${id}-factor`}
                  label={words.factor}
                  value={row.factor}
                  placeholder="1"
                  error={row.factor.trim() && !isFactor(row.factor) ? words.unread.factor : undefined}
                  write={(factor) => change({ factor })}
                />
              )}
              {carriesError(row.end) && (
                <TextField
                  id={`${id}-error`}
                  label={words.error}
                  mono
                  value={row.error}
                  placeholder="ROUTE_BLOCKED"
                  write={(error) => change({ error })}
                />
              )}
            </>
          );
        }}
      />
    </fieldset>
  );
}
