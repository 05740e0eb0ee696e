// Who may set breakpoints of a run, and how that is done.
import { command } from "../../shared/command";
import { may } from "../../shared/session";
import { toast } from "../../shared/Toasts";
import { strings } from "../../strings";
import type { OperateContext, Place } from "../context";
import type { MissionModel } from "../mission/missionModel";
import { breakpointsOf, turned } from "./breakpoints";

const text = strings.debug;

export type Shown = Pick<OperateContext, "scene" | "fleet">;

/** Why breakpoints cannot be set in a run that goes on; "": they can. null: it does not go on. */
export function refusalOf({ scene, fleet }: Shown): string | null {
  const status = scene.status.value;
  if (scene.mode !== "live" || (status !== "running" && status !== "paused")) return null;
  if (!fleet.may_be_debugged) return text.fleet;
  return may("operator") ? "" : text.viewer;
}

/** A process has none, but the elements in it. */
export const mayHaveOne = (mission: MissionModel, { process, element }: Place): boolean =>
  mission.node(process, element)?.type !== "Process";

export const pathOf = ({ scene }: Pick<Shown, "scene">): string =>
  `/runs/${encodeURIComponent(scene.run)}`;

/** Set a breakpoint at an element, or remove it. */
export function turn(shown: Shown, element: string): void {
  const refusal = refusalOf(shown);
  if (refusal) toast(refusal, "bad");
  if (refusal !== "") return;
  const { elements, conditions } = breakpointsOf(shown.scene.debugging.peek());
  const body = { elements: turned(elements, element), conditions };
  void command(`${pathOf(shown)}/breakpoints`, body, true);
}
