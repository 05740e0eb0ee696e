import { describe, expect, it } from "vitest";
import { extentOf, HOST, sizeOf, type Fragment } from "./fragment";
import { ATTACHED, attachedOf, fragmentOf, KINDS } from "./fragments";

const ALL: [string, Fragment][] = [
  ...KINDS.map((kind): [string, Fragment] => [kind, fragmentOf(kind)]),
  ...[...ATTACHED].map((kind): [string, Fragment] => [`${kind} on an activity`, attachedOf(kind)]),
];

describe.each(ALL)("the fragment of %s", (_, { nodes, flows, entry, exit }) => {
  const ids = new Set([...nodes.map(({ id }) => id), HOST]);
  const isInner = (id: string) => nodes.find((each) => each.id === id)?.in !== undefined;
  const leading = (from: string) => flows.filter((flow) => flow.from === from);

  it("has flows between its elements only, within one scope", () => {
    for (const { from, to } of flows) {
      expect([ids.has(from), ids.has(to)]).toEqual([true, true]);
      expect(isInner(from)).toBe(isInner(to));
    }
  });

  it("goes on from each element, but for its exit and for ends", () => {
    for (const { id, type } of nodes) {
      if (id === exit || type === "bpmn:EndEvent") continue;
      expect(leading(id).length, id).toBeGreaterThan(0);
    }
    expect(ids.has(entry)).toBe(true);
  });

  it("decides where exclusive gateways split: all but a default have a condition", () => {
    for (const { id } of nodes.filter(({ type }) => type === "bpmn:ExclusiveGateway")) {
      const out = leading(id);
      if (out.length < 2) continue;
      expect(out.filter(({ isDefault }) => isDefault)).toHaveLength(1);
      expect(out.every(({ isDefault, when }) => Boolean(isDefault) !== Boolean(when))).toBe(true);
    }
  });

  it("has what is in a subprocess within its borders, and nothing upon another", () => {
    const box = (id: string) => {
      const node = nodes.find((each) => each.id === id)!;
      const [width, height] = sizeOf(node);
      return { x: node.at[0] - width / 2, y: node.at[1] - height / 2, width, height };
    };
    const outer = nodes.filter((each) => !each.on);
    for (const one of outer) {
      for (const other of outer) {
        if (one === other || one.id === other.in || other.id === one.in) continue;
        const [a, b] = [box(one.id), box(other.id)];
        const apart =
          a.x + a.width <= b.x || b.x + b.width <= a.x || a.y + a.height <= b.y || b.y + b.height <= a.y;
        expect(apart, `${one.id} and ${other.id}`).toBe(true);
      }
      if (!one.in) continue;
      const [inner, border] = [box(one.id), box(one.in)];
      expect(inner.x).toBeGreaterThan(border.x);
      expect(inner.y + inner.height).toBeLessThan(border.y + border.height);
    }
  });
});

describe("what a search says about a block", () => {
  it("is in its events and names", () => {
    const [wait] = fragmentOf("wait", { duration: "PT5M" }).nodes;
    expect(wait).toMatchObject({ name: "Wait 5 min", event: { kind: "timer", after: "PT5M" } });
    const [again] = fragmentOf("repeat", { count: 5 }).nodes;
    expect(again).toMatchObject({ name: "Repeat 5 times", times: 5 });
    const [late] = attachedOf("within", { duration: "PT90S" }).nodes;
    expect(late).toMatchObject({ name: "After 90 s", event: { kind: "timer", after: "PT90S" } });
  });

  it("makes room for the size of the activity that it is put on", () => {
    const { right, bottom } = extentOf(attachedOf("fails", {}, [300, 200]));
    expect(right).toBeGreaterThan(150 + 50);
    expect(bottom).toBeGreaterThan(100 + 100);
  });
});
