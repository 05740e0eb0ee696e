// Which behavior a task commands, and with what parameters.
import { useMemo } from "preact/hooks";
import type { Behavior, Parameter } from "../../../shared/types";
import { fill, strings } from "../../../strings";
import { titleOf, useOf } from "../../blocks/blocks";
import { behaviorOf, isByNeed, setBehavior, type BehaviorUse } from "../../moddle/behavior";
import { isA, text } from "../../moddle/moddle";
import type { Catalogue } from "../../session/catalogue";
import { ComboField } from "../fields/ComboField";
import type { Suggestion } from "../fields/Listbox";
import { apply, factoryOf, objectOf, type FormProps } from "../form";
import { ParameterField } from "./ParameterField";

const words = strings.editor.behavior;
const NONE = "";

export function BehaviorForm(form: FormProps) {
  const task = objectOf(form);
  const use = behaviorOf(task);
  const { catalogue } = form.editor;
  const meant = use && catalogue.meant(use);
  const write = (next: BehaviorUse | undefined) =>
    apply(form, setBehavior(factoryOf(form), task, next));
  return (
    <>
      <ComboField
        id="m2-behavior"
        label={words.label}
        strict
        value={use ? keyOf(catalogue, use, meant) : NONE}
        suggestions={suggestionsOf(catalogue, use, meant, isA(task, "bpmn:ScriptTask"))}
        placeholder={words.choose}
        error={use && !meant ? fill(words.unknown, { name: use.name }) : undefined}
        hint={meant?.doc || undefined}
        write={(key) => {
          const behavior = catalogue.behaviors[Number(key)];
          if (key === NONE) write(undefined);
          else if (behavior) write(changedTo(catalogue, behavior, use));
        }}
      />
      {use && <Parameters form={form} use={use} meant={meant} write={write} />}
      {meant && <Facts behavior={meant} />}
      {!use && text(task, "script").trimStart().startsWith("<") && (
        <p class="m2-note">{words.inScript}</p>
      )}
    </>
  );
}

interface ParametersProps {
  form: FormProps;
  use: BehaviorUse;
  meant: Behavior | undefined;
  write(use: BehaviorUse): void;
}

function Parameters({ form, use, meant, write }: ParametersProps) {
  const known = meant?.parameters ?? [];
  const unknown = use.parameters.filter(({ name }) => !known.some((each) => each.name === name));
  const needed = isNeeded(meant);
  // Sorted when the behavior is chosen, not while values are typed: fields would jump away.
  const given = useMemo(
    () => new Set(use.parameters.map(({ name }) => name)),
    [form.element, use.name],
  );
  const first = known.filter((each) => needed(each) || given.has(each.name));
  const further = known.filter((each) => !first.includes(each));
  // A value that is picked on the map may come when others have been changed meanwhile.
  const change = (name: string, value: string) =>
    write(withParameter(behaviorOf(objectOf(form)) ?? use, name, value));
  const valueOf = (name: string) => use.parameters.find((each) => each.name === name)?.value ?? "";
  const field = (spec: Parameter) => (
    <ParameterField
      key={`${use.name} ${spec.name}`}
      form={form}
      editor={form.editor}
      parameter={spec}
      value={valueOf(spec.name)}
      write={(value) => change(spec.name, value)}
    />
  );
  return (
    <>
      {missingGroups(meant, use).map((groups) => (
        <p class="m2-note m2-note-wrong" key={groups}>
          {fill(words.oneOf, { groups })}
        </p>
      ))}
      {first.map(field)}
      {further.length > 0 && (
        <details class="m2-further">
          <summary>{fill(words.further, { count: further.length })}</summary>
          {further.map(field)}
        </details>
      )}
      {unknown.map(({ name, value }) => (
        <ParameterField
          key={`${use.name} ${name}`}
          form={form}
          editor={form.editor}
          parameter={unknownParameter(name)}
          value={value}
          error={meant ? words.unknownParameter : undefined}
          write={(next) => change(name, next)}
        />
      ))}
    </>
  );
}

function Facts({ behavior }: { behavior: Behavior }) {
  const facts = [
    behavior.ends ? "" : words.endless,
    behavior.writes.length ? fill(words.writes, { names: behavior.writes.join(", ") }) : "",
  ].filter(Boolean);
  return facts.length ? <p class="m2-note">{facts.join(" ")}</p> : null;
}

function isNeeded(behavior: Behavior | undefined) {
  const oneOf = new Set(behavior?.required_one_of.flat());
  return (parameter: Parameter) => parameter.required || oneOf.has(parameter.name);
}

/** "area, or target" where neither is given. */
function missingGroups(behavior: Behavior | undefined, use: BehaviorUse): string[] {
  const groups = behavior?.required_one_of ?? [];
  const given = new Set(use.parameters.filter((each) => each.value !== "").map(({ name }) => name));
  if (groups.length === 0 || groups.some((names) => names.every((name) => given.has(name))))
    return [];
  return [groups.map((names) => names.map(titleOf).join(words.and)).join(words.or)];
}

export function withParameter(use: BehaviorUse, name: string, value: string): BehaviorUse {
  const known = use.parameters.some((each) => each.name === name);
  const changed = use.parameters.map((each) => (each.name === name ? { name, value } : each));
  const all = known ? changed : [...use.parameters, { name, value }];
  return { ...use, parameters: all.filter((each) => each.value !== "") };
}

/** Another behavior: parameters of the same names stay, and so does who does it, if they can. */
function changedTo(catalogue: Catalogue, behavior: Behavior, before: BehaviorUse | undefined) {
  const candidates = catalogue.candidates(behavior);
  const fresh = useOf(catalogue, behavior, candidates);
  if (!before) return fresh;
  const names = new Set(behavior.parameters.map(({ name }) => name));
  const kept = before.parameters.filter(({ name }) => names.has(name));
  const added = fresh.parameters.filter(({ name }) => !kept.some((each) => each.name === name));
  const roles = before.roles.filter(
    (role) => isByNeed(role) || candidates.some(({ id }) => id === role.resource),
  );
  return {
    ...fresh,
    parameters: [...kept, ...added],
    roles: roles.length ? roles : fresh.roles,
  };
}

function keyOf(catalogue: Catalogue, use: BehaviorUse, meant: Behavior | undefined): string {
  return meant ? String(catalogue.behaviors.indexOf(meant)) : use.name;
}

function suggestionsOf(
  catalogue: Catalogue,
  use: BehaviorUse | undefined,
  meant: Behavior | undefined,
  mayHaveNone: boolean,
): Suggestion[] {
  const known = catalogue.behaviors.map((behavior, index) => ({
    value: String(index),
    label: titleOf(behavior.name),
    note: behavior.name,
    group: words.types[behavior.type],
  }));
  known.sort((a, b) => a.group.localeCompare(b.group) || a.label.localeCompare(b.label));
  const unknown = use && !meant ? [{ value: use.name, label: titleOf(use.name) }] : [];
  const none = mayHaveNone ? [{ value: NONE, label: words.none }] : [];
  return [...none, ...unknown, ...known];
}

function unknownParameter(name: string): Parameter {
  const nothing = { unit: "", required: false, minimum: null, maximum: null, default: null };
  return { name, kind: "text", choices: [], doc: "", ...nothing };
}
