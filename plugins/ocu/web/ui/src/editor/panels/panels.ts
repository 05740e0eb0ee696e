// The tabs beside the canvas, in order. A further one is a module here and a line below.
import { commentsPanel } from "../../comments/CommentsPanel";
import type { Panel } from "./panel";
import { problemsPanel } from "./ProblemsPanel";
import { propertiesPanel } from "./PropertiesPanel";
import { runPanel } from "./run/RunPanel";
import { verifyPanel } from "./verify/VerifyPanel";

export const panels: readonly Panel[] = [
  propertiesPanel,
  problemsPanel,
  verifyPanel,
  runPanel,
  commentsPanel,
];
