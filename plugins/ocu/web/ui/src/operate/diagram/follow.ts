// Which view shows what is going on.
import type { MissionModel } from "../mission/missionModel";
import type { ElementBoard } from "../scene/elementBoard";

export interface Activity {
  /** Elements with tokens that nothing else is inside of. */
  active: number;
  asks: boolean;
  /** Mission time of the last change. */
  last: number;
}

const AROUND = new Set(["CallActivity", "SubProcess", "Transaction", "AdHocSubProcess"]);

export function activityOf(mission: MissionModel, board: ElementBoard): Map<string, Activity> {
  const found = new Map<string, Activity>();
  for (const [process, element, state] of board.all()) {
    if (state.active === 0 && !state.asking) continue;
    const view = mission.viewOf(process, element);
    if (!view) continue;
    const activity = found.get(view.key) ?? { active: 0, asks: false, last: 0 };
    const around = AROUND.has(mission.node(process, element)?.type ?? "");
    found.set(view.key, {
      active: activity.active + (around ? 0 : 1),
      asks: activity.asks || state.asking,
      last: Math.max(activity.last, around ? 0 : state.last),
    });
  }
  return found;
}

/** A question draws the eye; else one stays where something goes on. */
export function follow(activity: ReadonlyMap<string, Activity>, shown: string): string {
  const now = activity.get(shown);
  const asking = [...activity].find(([, { asks }]) => asks);
  if (asking && !now?.asks) return asking[0];
  if (now && (now.active > 0 || now.asks)) return shown;
  const [newest] = [...activity]
    .filter(([, { active }]) => active > 0)
    .sort(([, one], [, other]) => other.last - one.last);
  return newest?.[0] ?? shown;
}
