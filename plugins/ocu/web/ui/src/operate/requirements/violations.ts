// Which elements the violated requirements of a run are about.
import type { Requirement } from "../../shared/types";
import type { MissionModel, MissionNode } from "../mission/missionModel";
import { keyOf } from "../mission/names";
import type { Requirements } from "../scene/scene";

/** The names of requirements, by the keys of elements (`keyOf`). */
export type Violations = ReadonlyMap<string, readonly string[]>;

/** What tells it without a colour. */
export const VIOLATION = "!";

export const isViolated = ({ verdict }: Requirement): boolean => verdict === "violated";

type Nodes = Pick<MissionModel, "nodesOf">;

/** The elements that a requirement is about, as far as the diagrams have them. */
export const placesOf = ({ elements }: Requirement, mission: Nodes): readonly MissionNode[] =>
  elements.flatMap((id) => mission.nodesOf(id));

export function violationsIn(requirements: Requirements, mission: Nodes): Violations {
  const found = new Map<string, string[]>();
  for (const [name, requirement] of Object.entries(requirements)) {
    if (!isViolated(requirement)) continue;
    for (const { process, id } of placesOf(requirement, mission)) {
      const key = keyOf(process, id);
      found.set(key, [...(found.get(key) ?? []), name]);
    }
  }
  return found;
}

const ORDER = { violated: 0, open: 1, satisfied: 2 };

/** What needs attention first; of those alike, the first ones of the mission first. */
export const inOrder = (requirements: Requirements): [string, Requirement][] =>
  Object.entries(requirements).sort(
    ([, one], [, other]) => ORDER[one.verdict] - ORDER[other.verdict],
  );
