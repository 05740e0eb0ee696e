// Which entries of the schedule are shown, and in which order: as they will start.
import type { ScheduledMission, ScheduledStatus } from "../shared/types";

const OVER: ReadonlySet<ScheduledStatus> = new Set(["ended", "cancelled", "failed"]);
/** Of those that are over, unless more are asked for. */
const SHOWN_OVER = 3;

export const isOver = ({ status }: Pick<ScheduledMission, "status">): boolean => OVER.has(status);

export const nameOf = ({ mission }: Pick<ScheduledMission, "mission">): string =>
  mission.replace(/^.*[\\/]/, "").replace(/\.bpmn$/, "");

export interface Wanted {
  /** Words that are in the id, the mission, who scheduled it, or what it waits for. */
  text: string;
  status: ScheduledStatus | "";
}

/** Those that wait come first, the greatest priority before the others; then those with a date. */
export function inOrder(
  entries: readonly ScheduledMission[],
  { text, status }: Wanted,
): ScheduledMission[] {
  const words = text.toLowerCase().split(/\s+/).filter(Boolean);
  const found = entries.filter((each) => {
    const said = `${each.entry} ${nameOf(each)} ${each.by} ${each.when} ${each.reason}`.toLowerCase();
    return (!status || each.status === status) && words.every((word) => said.includes(word));
  });
  const isNarrowed = words.length > 0 || status !== "";
  const over = found.filter(isOver);
  const active = found.filter((each) => !isOver(each));
  active.sort(
    (one, other) =>
      Number(other.status === "waiting") - Number(one.status === "waiting") ||
      (one.status === "waiting" ? other.priority - one.priority : 0) ||
      startOf(one) - startOf(other),
  );
  return [...active, ...(isNarrowed ? over : over.slice(-SHOWN_OVER))];
}

const startOf = ({ starts_us, due_us, next_us }: ScheduledMission): number =>
  starts_us ?? due_us ?? next_us ?? Infinity;
