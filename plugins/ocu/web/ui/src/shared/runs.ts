// How runs are called.
import type { RunSummary } from "./types";

/** By the mission's name, without the folder that its file is in. */
export const titleOf = ({ mission, process }: RunSummary): string =>
  mission.replace(/^.*[\\/]/, "").replace(/\.bpmn$/, "") || process;
