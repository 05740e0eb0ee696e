// Who does what a task commands: roles, each with a vehicle, a payload or a team.
import { fill, strings } from "../../../strings";
import { roleName } from "../../blocks/blocks";
import { behaviorOf, isByNeed, serviceOf, setBehavior, setService } from "../../moddle/behavior";
import { WAITS, type Need, type Role } from "../../moddle/behavior";
import type { Candidate, Catalogue } from "../../session/catalogue";
import { CheckField, SelectField, type Option } from "../fields/SelectField";
import { TextField } from "../fields/TextField";
import { apply, factoryOf, objectOf, type FormProps } from "../form";
import { NeedFields } from "./NeedFields";
import { Rows } from "./Rows";

const words = strings.editor.roles;

/** The choice of a role that names nothing; no resource can have that name. */
const BY_NEED = "/";

export function RolesForm(form: FormProps) {
  const task = objectOf(form);
  const { catalogue } = form.editor;
  const behavior = behaviorOf(task);
  const service = behavior ? undefined : serviceOf(task);
  const roles = behavior?.roles ?? service?.roles ?? [];
  const candidates = candidatesOf(form);
  const write = (next: Role[]) => {
    const factory = factoryOf(form);
    if (behavior) apply(form, setBehavior(factory, task, { ...behavior, roles: next }));
    else
      apply(form, setService(factory, task, { name: "", parameters: [], ...service, roles: next }));
  };
  const change = (index: number, role: Role) => write(roles.with(index, role));
  return (
    <Rows
      rows={roles}
      write={write}
      addLabel={words.add}
      empty={behavior ? words.none : words.noneNeeded}
      add={() => newRole(catalogue, candidates, roles)}
      label={(role) => role.name || words.unnamed}
      render={(role, index) => (
        <>
          <SelectField
            id={`m2-role-${index}`}
            label={role.optional ? words.resourceOptional : words.resource}
            required={!role.optional}
            value={isByNeed(role) ? BY_NEED : role.resource}
            options={optionsOf(candidates, behavior !== undefined)}
            error={errorOf(catalogue, role, candidates)}
            write={(id) => change(index, filledBy(role, id, candidates))}
          />
          <TextField
            id={`m2-role-name-${index}`}
            label={words.name}
            required
            value={role.name}
            write={(name) => change(index, { ...role, name: name.trim() })}
          />
          <CheckField
            id={`m2-role-optional-${index}`}
            label={words.optional}
            value={role.optional}
            write={(optional) => change(index, { ...role, optional })}
          />
          {behavior && (
            <NeedFields
              form={form}
              index={index}
              role={role}
              write={(need) => change(index, { ...role, need })}
            />
          )}
        </>
      )}
    />
  );
}

function candidatesOf(form: FormProps): Candidate[] {
  const { catalogue } = form.editor;
  const behavior = behaviorOf(objectOf(form));
  const meant = behavior && catalogue.meant(behavior);
  if (meant) {
    const sameName = catalogue.behaviors.filter(
      (each) => each.name === meant.name && each.type === meant.type,
    );
    return sameName.flatMap((each) => catalogue.candidates(each));
  }
  if (behavior)
    return (["vehicle", "payload", "team"] as const).flatMap((kind) => catalogue.everybody(kind));
  const isDetector = serviceOf(objectOf(form))?.name === "Detector";
  return isDetector
    ? catalogue.detectors()
    : [...catalogue.everybody("payload"), ...catalogue.everybody("vehicle")];
}

function newRole(catalogue: Catalogue, candidates: Candidate[], roles: readonly Role[]): Role {
  const free = candidates.filter(({ id }) => !roles.some((role) => role.resource === id));
  const base = roleName(catalogue, candidates[0]);
  const taken = new Set(roles.map(({ name }) => name));
  let name = base;
  for (let number = 2; taken.has(name); number += 1) name = `${base}${number}`;
  const [only] = free;
  return {
    name,
    kind: only?.kind ?? "vehicle",
    resource: free.length === 1 && only ? only.id : "",
    optional: false,
  };
}

/** A role that names a resource, or that takes any which can do it until more is said. */
function filledBy(role: Role, id: string, candidates: readonly Candidate[]): Role {
  if (id === BY_NEED)
    return { ...role, resource: "", need: { requires: "true", ...role.need } };
  const kind = candidates.find((each) => each.id === id)?.kind ?? role.kind;
  const need: Need = {};
  for (const name of WAITS) if (role.need?.[name]) need[name] = role.need[name];
  return { ...role, kind, resource: id, need };
}

function optionsOf(candidates: readonly Candidate[], byNeed: boolean): Option[] {
  const options = candidates.map(({ kind, id, domain }) => ({
    value: id,
    label: id,
    group: kind === "vehicle" && domain ? strings.editor.blocks.groups[domain] : words.kinds[kind],
  }));
  const chosen = byNeed ? [{ value: BY_NEED, label: words.byNeed }] : [];
  return [{ value: "", label: words.choose }, ...chosen, ...options];
}

function errorOf(
  catalogue: Catalogue,
  role: Role,
  candidates: readonly Candidate[],
): string | undefined {
  if (isByNeed(role)) return undefined;
  if (role.resource === "") return words.nobody;
  if (candidates.some(({ id }) => id === role.resource)) return undefined;
  const { vehicles, payloads, teams } = catalogue.fleet;
  const known = [...vehicles, ...payloads].some(({ id }) => id === role.resource);
  const isTeam = teams.some(({ name }) => name === role.resource);
  return known || isTeam
    ? fill(words.unfit, { id: role.resource })
    : fill(words.unknown, { id: role.resource });
}
