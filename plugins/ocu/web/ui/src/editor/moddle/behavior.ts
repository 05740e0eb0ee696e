// What a task commands: a behavior or a service, with parameters and with who does it.
import { extension, replaced, type Change } from "./extensions";
import { adopt, child, list, successor, text, type Factory, type ModdleElement } from "./moddle";

export interface ParameterValue {
  name: string;
  value: string;
}

export type ResourceKind = "vehicle" | "payload" | "team";

export const RESOURCE_KINDS: readonly ResourceKind[] = ["vehicle", "payload", "team"];

/** What says what a role needs, how long its task waits, and what is done when it is lost
 * (docs/allocation.md). */
export const NEEDS = [
  "requires",
  "same",
  "count",
  "prefer",
  "store",
  "wait",
  "priority",
  "onLoss",
  "keep",
] as const;

/** Those that a role which names its resource may have, too. */
export const WAITS: readonly NeedName[] = ["wait", "priority", "onLoss", "keep"];

export type NeedName = (typeof NEEDS)[number];

export type Need = Partial<Record<NeedName, string>>;

/** A role; `resource` is "" while nothing is chosen, and if it is filled by what it needs. */
export interface Role {
  name: string;
  kind: ResourceKind;
  resource: string;
  optional: boolean;
  need?: Need;
}

/** Whether vehicles or payloads are chosen for a role when its task starts. */
export const isByNeed = ({ need }: Role): boolean => Boolean(need?.requires ?? need?.same);

export interface Commanded {
  parameters: ParameterValue[];
  roles: Role[];
}

export interface BehaviorUse extends Commanded {
  type: string;
  name: string;
}

export interface ServiceUse extends Commanded {
  name: string;
}

const BEHAVIOR = "m2pem:Behavior";
const SERVICE = "m2pem:Service";
const SERVICE_ATTRIBUTES = ["m2pem:service", "m2pem:class"];
const FOREIGN_ATTRIBUTES = [
  "class",
  "camunda:class",
  "camunda:topic",
  "flowable:class",
  "activiti:class",
];

export function behaviorOf(task: ModdleElement): BehaviorUse | undefined {
  const element = extension(task, BEHAVIOR);
  return element && readBehavior(element);
}

export function readBehavior(element: ModdleElement): BehaviorUse {
  const head = (name: string) =>
    text(element, name) ||
    valueOf(list(element, "head").find((each) => text(each, "name") === name));
  return {
    type: head("type").trim(),
    name: head("name").trim(),
    parameters: list(child(element, "parameters"), "values").map(readParameter),
    roles: list(child(element, "allocation"), "values").map((each) => readRole(each, head("type"))),
  };
}

export function serviceOf(task: ModdleElement): ServiceUse | undefined {
  const element = extension(task, SERVICE);
  const name = (element && text(element, "class")) || attributeClass(task);
  if (!element && !name) return undefined;
  const nested = (wrapper: string) => list(element && child(element, wrapper), "values");
  return {
    name,
    parameters: [...nested("parameters"), ...list(element, "loose")].map(readParameter),
    roles: [...nested("allocation"), ...list(element, "roles")].map((each) =>
      readRole(each, "payload"),
    ),
  };
}

/** Lets a task command a behavior, or (undefined) nothing. */
export function setBehavior(
  factory: Factory,
  task: ModdleElement,
  use: BehaviorUse | undefined,
): Change[] {
  const before = extension(task, BEHAVIOR);
  const made = use ? [writeBehavior(factory, use, before)] : [];
  return [replaced(factory, task, [BEHAVIOR], made)];
}

export function writeBehavior(
  factory: Factory,
  use: BehaviorUse,
  before?: ModdleElement,
): ModdleElement {
  const parameters = writeParameters(
    factory,
    use.parameters,
    before && child(before, "parameters"),
  );
  const allocation = writeRoles(factory, use.roles, before && child(before, "allocation"));
  const others = list(before, "others");
  const made = successor(
    factory,
    BEHAVIOR,
    {
      type: use.type,
      name: use.name,
      parameters: use.parameters.length ? parameters : undefined,
      allocation: use.roles.length ? allocation : undefined,
      others: others.length ? others : undefined,
    },
    before,
  );
  adopt(made, parameters, allocation, ...others);
  return made;
}

export function setService(factory: Factory, task: ModdleElement, use: ServiceUse): Change[] {
  const before = extension(task, SERVICE);
  const roles = use.roles.map((role) => writeRole(factory, role));
  const loose = use.parameters.map((each) => writeParameter(factory, each));
  const others = list(before, "others");
  const made = successor(
    factory,
    SERVICE,
    { class: use.name || undefined, roles, loose, others: others.length ? others : undefined },
    before,
  );
  adopt(made, ...roles, ...loose, ...others);
  const isSaid = use.name !== "" || roles.length > 0 || loose.length > 0;
  const properties: Record<string, undefined> = {};
  for (const name of [...SERVICE_ATTRIBUTES, ...FOREIGN_ATTRIBUTES]) {
    if (attribute(task, name) !== "") properties[name] = undefined;
  }
  const extensions = replaced(factory, task, [SERVICE], isSaid ? [made] : []);
  return Object.keys(properties).length ? [extensions, { target: task, properties }] : [extensions];
}

function attributeClass(task: ModdleElement): string {
  for (const name of [...SERVICE_ATTRIBUTES, ...FOREIGN_ATTRIBUTES]) {
    const said = attribute(task, name);
    if (said) return said;
  }
  return "";
}

function attribute(element: ModdleElement, name: string): string {
  if (name.startsWith("m2pem:")) return text(element, name).trim();
  return (element.$attrs[name] ?? "").trim();
}

function valueOf(element: ModdleElement | undefined): string {
  return element ? text(element, "value") || text(element, "body").trim() : "";
}

function readParameter(element: ModdleElement): ParameterValue {
  return { name: text(element, "name"), value: valueOf(element) };
}

function readRole(element: ModdleElement, type: string): Role {
  const named = RESOURCE_KINDS.find((kind) => text(element, kind) !== "");
  const otherwise = RESOURCE_KINDS.find((kind) => kind === type) ?? "vehicle";
  const needs = NEEDS.filter((name) => text(element, name) !== "");
  return {
    name: text(element, "name"),
    kind: named ?? otherwise,
    resource: named ? text(element, named) : "",
    optional: ["true", "1"].includes(text(element, "optional")),
    ...(needs.length && {
      need: Object.fromEntries(needs.map((name) => [name, text(element, name)])),
    }),
  };
}

function writeParameters(
  factory: Factory,
  values: readonly ParameterValue[],
  before?: ModdleElement,
): ModdleElement {
  const olds = list(before, "values");
  const made = values.map((each) => {
    const old = olds.find((other) => text(other, "name") === each.name);
    return old && valueOf(old) === each.value ? old : writeParameter(factory, each, old);
  });
  const outer = successor(factory, "m2pem:Properties", { values: made }, before);
  adopt(outer, ...made);
  return outer;
}

function writeParameter(
  factory: Factory,
  { name, value }: ParameterValue,
  before?: ModdleElement,
): ModdleElement {
  const id = before && (text(before, "id") || undefined);
  return successor(factory, "m2pem:Property", { id, name, value }, before);
}

function writeRoles(
  factory: Factory,
  roles: readonly Role[],
  before?: ModdleElement,
): ModdleElement {
  const olds = list(before, "values");
  const made = roles.map((role) =>
    writeRole(
      factory,
      role,
      olds.find((other) => text(other, "name") === role.name),
    ),
  );
  const outer = successor(factory, "m2pem:Resources", { values: made }, before);
  adopt(outer, ...made);
  return outer;
}

function writeRole(factory: Factory, role: Role, before?: ModdleElement): ModdleElement {
  return successor(
    factory,
    "m2pem:Role",
    {
      name: role.name,
      [role.kind]: role.resource || undefined,
      optional: role.optional ? "true" : undefined,
      ...role.need,
    },
    before,
  );
}
