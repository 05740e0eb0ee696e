// A piece of a diagram that is put in as one: elements with their places, and the flows between them.
import type { TaskContent } from "../blocks";

export type EventUse =
  | { kind: "timer"; after: string }
  | { kind: "date"; at: string }
  | { kind: "condition"; when: string }
  | { kind: "signal"; name: string; fromOperators: boolean }
  | { kind: "escalation"; name: string }
  | { kind: "error" }
  | { kind: "terminate" };

export interface FragmentNode {
  id: string;
  type: string;
  name: string;
  /** Its centre, seen from the centre of the entry, in pixels. */
  at: readonly [x: number, y: number];
  size?: readonly [width: number, height: number];
  /** The subprocess that it is in. */
  in?: string;
  /** The activity at whose border it is; `HOST`: the one that the fragment is put on. */
  on?: string;
  event?: EventUse;
  content?: TaskContent;
  /** How many times, one after the other. */
  times?: number;
}

export interface FragmentFlow {
  from: string;
  to: string;
  name?: string;
  /** A condition. */
  when?: string;
  isDefault?: boolean;
  /** Its way, seen from the centre of the entry; else it is laid out. */
  way?: readonly (readonly [x: number, y: number])[];
}

export interface Fragment {
  nodes: readonly FragmentNode[];
  flows: readonly FragmentFlow[];
  /** What comes before leads to it. */
  entry: string;
  /** What comes after begins here. */
  exit: string;
}

export const HOST = "host";

const SIZES: readonly [type: RegExp, size: readonly [number, number]][] = [
  [/Gateway$/, [50, 50]],
  [/Event$/, [36, 36]],
];
const TASK = [100, 80] as const;

export function sizeOf({ type, size }: FragmentNode): readonly [width: number, height: number] {
  return size ?? SIZES.find(([pattern]) => pattern.test(type))?.[1] ?? TASK;
}

export interface Extent {
  left: number;
  right: number;
  top: number;
  bottom: number;
}

/** How far it reaches, seen from the centre of the entry. */
export function extentOf({ nodes }: Fragment): Extent {
  const half = (node: FragmentNode, axis: 0 | 1) => sizeOf(node)[axis] / 2;
  return {
    left: Math.min(...nodes.map((each) => each.at[0] - half(each, 0))),
    right: Math.max(...nodes.map((each) => each.at[0] + half(each, 0))),
    top: Math.min(...nodes.map((each) => each.at[1] - half(each, 1))),
    bottom: Math.max(...nodes.map((each) => each.at[1] + half(each, 1))),
  };
}
