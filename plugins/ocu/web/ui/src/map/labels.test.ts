import { describe, expect, it } from "vitest";
import { markCrowded } from "./labels";

/** A label from `left` on, 40 px wide and 10 px high. */
function label(left: number) {
  const classes = new Set<string>();
  const element = {
    classList: {
      remove: (name: string) => classes.delete(name),
      toggle: (name: string, on: boolean) => (on ? classes.add(name) : classes.delete(name)),
    },
    getBoundingClientRect: () => ({ left, right: left + 40, top: 0, bottom: 10 }),
  };
  return { element: element as unknown as HTMLElement, classes };
}

describe("labels of a map", () => {
  it("are marked where one before them is, and no longer when that has moved", () => {
    const [first, over, beside] = [label(0), label(30), label(45)];
    markCrowded([first, over, beside], "crowded");
    expect([first, over, beside].map(({ classes }) => classes.has("crowded"))).toEqual([
      false,
      true,
      false, // the one that it lies on is not shown
    ]);
    markCrowded([over], "crowded");
    expect(over.classes.has("crowded")).toBe(false);
  });

  it("are marked where something else is, unless they stay", () => {
    const [marked, staying] = [label(0), label(0)];
    const taken = { left: 30, right: 50, top: 0, bottom: 5 } as DOMRect;
    markCrowded([marked, { ...staying, stays: true }], "crowded", [taken]);
    expect(marked.classes.has("crowded")).toBe(true);
    expect(staying.classes.has("crowded")).toBe(false);
  });
});
