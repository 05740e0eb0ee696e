import { beforeEach, describe, expect, it } from "vitest";
import type { ElementState } from "../../shared/types";
import { ElementBoard, type ElementChange } from "./elementBoard";

const state = (fields: Partial<ElementState> = {}): ElementState => ({
  active: 0,
  hits: 0,
  last: 0,
  failed: false,
  asking: false,
  waiting: false,
  ...fields,
});

let board: ElementBoard;
let told: ElementChange[][];

beforeEach(() => {
  board = new ElementBoard();
  told = [];
  board.listen((changes) => void told.push(changes));
});

describe("element board", () => {
  it("tells what changed, and nothing else", () => {
    board.merge({ P: { A: state({ active: 1 }), B: state() } });
    board.merge({ P: { A: state({ active: 1 }), B: state({ hits: 1 }) } });
    expect(told.map((changes) => changes.map(({ element }) => element))).toEqual([
      ["A", "B"],
      ["B"],
    ]);
    expect(told[1]![0]).toMatchObject({ before: { hits: 0 }, state: { hits: 1 } });
  });

  it("says nothing when nothing changed", () => {
    board.merge({ P: { A: state({ active: 1 }) } });
    board.replace({ P: { A: state({ active: 1 }) } });
    expect(told).toHaveLength(1);
  });

  it("forgets what a replacement does not have", () => {
    board.merge({ P: { A: state({ active: 2, hits: 3 }) }, Q: { A: state({ hits: 1 }) } });
    board.replace({ Q: { A: state({ hits: 1 }) } });
    expect(board.get("P", "A")).toEqual(state());
    expect(told[1]!.map(({ process, element }) => [process, element])).toEqual([["P", "A"]]);
  });

  it("keeps elements of the same name in two processes apart", () => {
    board.merge({ P: { A: state({ active: 1 }) }, Q: { A: state({ active: 5 }) } });
    expect(board.get("P", "A")!.active).toBe(1);
    expect(board.get("Q", "A")!.active).toBe(5);
  });

  it("does not follow later changes of what it was given", () => {
    const given = { P: { A: state({ active: 1 }) } };
    board.merge(given);
    given.P.A.active = 9;
    expect(board.get("P", "A")!.active).toBe(1);
  });
});
