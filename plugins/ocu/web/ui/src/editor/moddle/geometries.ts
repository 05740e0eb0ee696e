// The routes, areas and points that a mission has itself: m2pem:geometry in a process's extension
// elements (docs/missions.md).
import { ownGeometry } from "../../map/ownGeometry";
import type { Geometry } from "../../shared/types";
import { behaviorOf, serviceOf, setBehavior, setService } from "./behavior";
import { extensions, replaced, type Change } from "./extensions";
import { isA, list, successor, text, type Factory, type ModdleElement } from "./moddle";

const TYPE = "m2pem:Geometry";

export interface NamedFeature {
  name: string;
  feature: GeoJSON.Feature;
  /** Left out: that of before, if the shape is the same; one that was changed is no part of it. */
  survey?: Geometry["survey"];
}

export const processesIn = (definitions: ModdleElement | undefined): ModdleElement[] =>
  list(definitions, "rootElements").filter((each) => isA(each, "bpmn:Process"));

/** Those that can be drawn, by name; what is wrong with others, the check says. */
export function geometriesOf(definitions: ModdleElement | undefined): Geometry[] {
  const found = processesIn(definitions)
    .flatMap((process) => extensions(process, TYPE))
    .flatMap((each) => {
      const read = ownGeometry(text(each, "name"), text(each, "body"));
      const pattern = text(each, "survey");
      if (!read || !pattern) return read ?? [];
      return { ...read, survey: { pattern, surveyor: text(each, "surveyor") } };
    });
  return found.sort((one, other) => one.name.localeCompare(other.name));
}

/** Puts geometries into the mission, each in place of the one that was called `before`; `gone` are
 * taken out. */
export function putGeometries(
  factory: Factory,
  definitions: ModdleElement,
  puts: readonly (NamedFeature & { before?: string })[],
  gone: readonly string[] = [],
): Change[] {
  const process = holderIn(definitions);
  if (!process) return [];
  const all = extensions(process, TYPE).filter((each) => !gone.includes(text(each, "name")));
  for (const put of puts) {
    const { name, before = name } = put;
    const at = all.findIndex((each) => text(each, "name") === before);
    const made = written(factory, put, all[at]);
    if (at < 0) all.push(made);
    else all[at] = made;
  }
  return [replaced(factory, process, [TYPE], all)];
}

export function removeGeometry(
  factory: Factory,
  definitions: ModdleElement,
  name: string,
): Change[] {
  return processesIn(definitions).flatMap((process) => {
    const all = extensions(process, TYPE);
    const kept = all.filter((each) => text(each, "name") !== name);
    return kept.length < all.length ? [replaced(factory, process, [TYPE], kept)] : [];
  });
}

/** Parameters of a task that name a geometry go on doing so under its new name. */
export function renameUses(
  factory: Factory,
  task: ModdleElement,
  before: string,
  name: string,
): Change[] {
  const renamed = (values: readonly { name: string; value: string }[]) =>
    values.map((each) => (each.value === before ? { ...each, value: name } : each));
  const behavior = behaviorOf(task);
  if (behavior) {
    const use = { ...behavior, parameters: renamed(behavior.parameters) };
    return setBehavior(factory, task, use);
  }
  const service = serviceOf(task);
  return service
    ? setService(factory, task, { ...service, parameters: renamed(service.parameters) })
    : [];
}

/** The process that has some already; else the first that can be started. */
function holderIn(definitions: ModdleElement): ModdleElement | undefined {
  const all = processesIn(definitions);
  return (
    all.find((each) => extensions(each, TYPE).length > 0) ??
    all.find((each) => each.get("isExecutable") === true) ??
    all[0]
  );
}

function written(
  factory: Factory,
  { name, feature: { properties, geometry }, survey }: NamedFeature,
  before?: ModdleElement,
): ModdleElement {
  const {
    altitude_frame = "relative",
    speeds_m_s,
    altitude_frames,
  } = (properties ?? {}) as Partial<Geometry>;
  const own = { ...(speeds_m_s && { speeds_m_s }), ...(altitude_frames && { altitude_frames }) };
  const value =
    altitude_frame === "relative" && Object.keys(own).length === 0
      ? geometry
      : { type: "Feature", properties: { altitude_frame, ...own }, geometry };
  const body = JSON.stringify(value);
  const isSame = before && text(before, "body") === body;
  const kept = (attribute: string) => (isSame && text(before, attribute)) || undefined;
  return successor(
    factory,
    TYPE,
    {
      name,
      survey: survey?.pattern ?? kept("survey"),
      surveyor: survey ? survey.surveyor || undefined : kept("surveyor"),
      body,
    },
    before,
  );
}

/** Another pattern for the routes of surveys; `rewritten` null: it stays as it is. */
export function surveyChanges(
  definitions: ModdleElement,
  rewritten: (survey: string) => string | null,
): Change[] {
  const all = processesIn(definitions).flatMap((process) => extensions(process, TYPE));
  return all.flatMap((target) => {
    const survey = rewritten(text(target, "survey"));
    return survey === null ? [] : [{ target, properties: { survey } }];
  });
}
