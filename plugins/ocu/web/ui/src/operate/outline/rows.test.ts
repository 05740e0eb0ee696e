import { describe, expect, it } from "vitest";
import type { MissionNode } from "../mission/missionModel";
import { moved, rowsOf } from "./rows";

const node = (id: string, ...children: MissionNode[]): MissionNode => ({
  process: "P",
  id,
  type: "Task",
  kind: "task",
  label: `The ${id}`,
  children,
  calls: "",
});

const TREES = [node("P", node("A"), node("S", node("B"), node("C")), node("D"))];
const ids = (folded: string[], wanted = "") =>
  rowsOf(TREES, new Set(folded.map((id) => `P\n${id}`)), wanted).map((row) => row.node.id);

describe("rows", () => {
  it("leave out what is inside of folded ones", () => {
    expect(ids([])).toEqual(["P", "A", "S", "B", "C", "D"]);
    expect(ids(["S"])).toEqual(["P", "A", "S", "D"]);
  });

  it("show what is looked for and what is around it, folded or not", () => {
    expect(ids(["S"], "the c")).toEqual(["P", "S", "C"]);
    expect(ids([], "nothing")).toEqual([]);
  });

  it("are walked with the arrow keys", () => {
    const rows = rowsOf(TREES, new Set(["P\nS"]), "");
    expect(moved(rows, "P\nA", "ArrowDown")).toEqual({ to: "P\nS" });
    expect(moved(rows, "P\nD", "ArrowDown")).toEqual({ to: "P\nD" });
    expect(moved(rows, "P\nS", "ArrowRight")).toEqual({ to: "P\nS", fold: false });
    expect(moved(rows, "P\nA", "ArrowLeft")).toEqual({ to: "P\nP" });
    expect(moved(rows, "P\nP", "ArrowLeft")).toEqual({ to: "P\nP", fold: true });
    expect(moved(rows, "P\nA", "End")).toEqual({ to: "P\nD" });
    expect(moved(rows, "P\nA", "x")).toBeNull();
  });
});
