// The tree of elements as the rows that are seen: what is folded or not looked for is left out.
import type { MissionNode } from "../mission/missionModel";
import { keyOf } from "../mission/names";

export interface Row {
  key: string;
  node: MissionNode;
  level: number;
  /** null: nothing is inside. */
  open: boolean | null;
  parent: string;
}

export function rowsOf(
  trees: readonly MissionNode[],
  folded: ReadonlySet<string>,
  wanted: string,
): Row[] {
  const rows: Row[] = [];
  const words = wanted.trim().toLowerCase();
  const add = (node: MissionNode, level: number, parent: string) => {
    if (words && !contains(node, words)) return;
    const key = keyOf(node.process, node.id);
    const open = node.children.length === 0 ? null : words !== "" || !folded.has(key);
    rows.push({ key, node, level, open, parent });
    if (open) for (const child of node.children) add(child, level + 1, key);
  };
  for (const tree of trees) add(tree, 1, "");
  return rows;
}

const contains = (node: MissionNode, words: string): boolean =>
  node.label.toLowerCase().includes(words) ||
  node.id.toLowerCase().includes(words) ||
  node.children.some((child) => contains(child, words));

export type Move = "ArrowDown" | "ArrowUp" | "ArrowLeft" | "ArrowRight" | "Home" | "End";

/** Where a key leads from a row, and whether it folds or unfolds it. */
export function moved(
  rows: readonly Row[],
  from: string,
  key: string,
): { to: string; fold?: boolean } | null {
  const at = Math.max(
    0,
    rows.findIndex((row) => row.key === from),
  );
  const row = rows[at];
  if (!row) return null;
  const to = (index: number) => ({ to: rows[Math.max(0, Math.min(index, rows.length - 1))]!.key });
  switch (key) {
    case "ArrowDown":
      return to(at + 1);
    case "ArrowUp":
      return to(at - 1);
    case "Home":
      return to(0);
    case "End":
      return to(rows.length - 1);
    case "ArrowRight":
      if (row.open === null) return { to: row.key };
      return row.open ? to(at + 1) : { to: row.key, fold: false };
    case "ArrowLeft":
      return row.open ? { to: row.key, fold: true } : { to: row.parent || row.key };
    default:
      return null;
  }
}
