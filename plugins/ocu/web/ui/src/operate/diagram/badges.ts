// Numbers at the corners of elements: how often a token came, how many are there now; and a sign
// for what failed, asks or waits; and the same in words, for screen readers. Renewed a few times a
// second: people read no faster.
import { nameSymbol } from "../../shared/elementNames";
import type { ElementState } from "../../shared/types";
import { markInWords, signOf, type Marks } from "../debug/breakpoints";
import { lookOf, SIGNS } from "./colours";
import type { Outline } from "./painter";
import { VIOLATION, type Violations } from "../requirements/violations";
import { statesOf, violationOf } from "./spoken";

const SVG = "http://www.w3.org/2000/svg";
const RENEWED_MS = 250;
/** To write hundreds at once takes the browser a while: then it is done less often. */
const EACH_MS = 4;
const HEIGHT = 16;
const DIGIT = 6.6;
/** Larger ones would hide what they belong to. */
const LARGEST = 1.8;

interface Badge {
  group: SVGElement;
  box: SVGElement;
  text: SVGElement;
  shown: string;
}

type Corner = "hits" | "tokens" | "sign" | "requirement" | "breakpoint";

/** Where it is, in widths and heights of the element. */
const AT: Record<Corner, readonly [number, number]> = {
  hits: [1, 0],
  tokens: [1, 1],
  sign: [0, 0],
  requirement: [0, 1],
  breakpoint: [0, 0.5],
};

export interface Badged {
  key: string;
  /** What it is called, without its state. */
  name: string;
  gfx: SVGElement;
  outline: Outline;
}

interface Waiting {
  badged: Badged;
  state: ElementState | undefined;
}

export class Badges {
  private readonly badges = new Map<string, Badge>();
  private readonly waiting = new Map<string, Waiting>();
  private readonly states = new Map<string, ElementState>();
  /** The violated requirements that elements are in. */
  private violations: Violations = new Map();
  private marks: Marks = new Map();
  private wrote = 0;
  private size = "";
  private timer: ReturnType<typeof setTimeout> | undefined;

  set(badged: Badged, state: ElementState): void {
    this.states.set(badged.key, state);
    this.soon(badged);
  }

  /** `all`: what may have badges. */
  violate(all: ReadonlyMap<string, Badged>, violations: Violations): void {
    const changed = [...this.violations.keys(), ...violations.keys()];
    this.violations = violations;
    this.renewAll(all, changed);
  }

  /** `all`: what may have badges. */
  mark(all: ReadonlyMap<string, Badged>, marks: Marks): void {
    const changed = [...this.marks.keys(), ...marks.keys()];
    this.marks = marks;
    this.renewAll(all, changed);
  }

  private renewAll(all: ReadonlyMap<string, Badged>, keys: readonly string[]): void {
    for (const key of new Set(keys)) {
      const badged = all.get(key);
      if (badged) this.soon(badged);
    }
  }

  private soon(badged: Badged): void {
    this.waiting.set(badged.key, { badged, state: this.states.get(badged.key) });
    this.timer ??= setTimeout(() => this.renew(), Math.max(RENEWED_MS, this.wrote * EACH_MS));
  }

  /** Numbers stay readable when all else gets small. */
  zoom(host: HTMLElement, scale: number): void {
    const size = Math.max(1, Math.min(LARGEST, 1 / scale)).toFixed(2);
    if (size === this.size) return;
    this.size = size;
    host.style.setProperty("--badge", size);
  }

  dispose(): void {
    clearTimeout(this.timer);
  }

  private renew(): void {
    this.timer = undefined;
    this.wrote = this.waiting.size;
    for (const { badged, state } of this.waiting.values()) {
      const { key, name, gfx, outline } = badged;
      const violated = this.violations.get(key) ?? [];
      const mark = this.marks.get(key);
      const said = [name, ...statesOf(state), violationOf(violated), markInWords(mark)];
      nameSymbol(gfx, said.filter(Boolean).join(", "));
      const { hits = 0, active = 0 } = state ?? {};
      this.write(`${key}\nhits`, gfx, outline, "hits", hits > 1 ? short(hits) : "");
      this.write(`${key}\ntokens`, gfx, outline, "tokens", active > 1 ? `● ${short(active)}` : "");
      this.write(`${key}\nsign`, gfx, outline, "sign", state ? SIGNS[lookOf(state)] : "");
      const sign = violated.length > 0 ? VIOLATION : "";
      this.write(`${key}\nrequirement`, gfx, outline, "requirement", sign);
      this.write(`${key}\nbreakpoint`, gfx, outline, "breakpoint", signOf(mark));
    }
    this.waiting.clear();
  }

  private write(
    key: string,
    gfx: SVGElement,
    outline: Outline,
    corner: Corner,
    text: string,
  ): void {
    let badge = this.badges.get(key);
    if (!badge && text === "") return;
    if (!badge) this.badges.set(key, (badge = make(gfx, corner)));
    if (badge.shown === text) return;
    badge.shown = text;
    badge.group.setAttribute("display", text === "" ? "none" : "inline");
    if (text === "") return;
    const width = Math.max(HEIGHT, text.length * DIGIT + 9);
    const [right, down] = AT[corner];
    const x = right * outline.width;
    const y = down * outline.height;
    badge.group.setAttribute("transform", `translate(${x} ${y})`);
    badge.box.setAttribute("x", String(-width / 2));
    badge.box.setAttribute("width", String(width));
    badge.text.textContent = text;
  }
}

function make(gfx: SVGElement, corner: Corner): Badge {
  const group = document.createElementNS(SVG, "g");
  group.setAttribute("class", `m2-badge m2-badge-${corner}`);
  const sized = document.createElementNS(SVG, "g");
  const box = document.createElementNS(SVG, "rect");
  box.setAttribute("y", String(-HEIGHT / 2));
  box.setAttribute("height", String(HEIGHT));
  box.setAttribute("rx", String(HEIGHT / 2));
  const text = document.createElementNS(SVG, "text");
  text.setAttribute("y", "4");
  text.setAttribute("text-anchor", "middle");
  sized.append(box, text);
  group.append(sized);
  gfx.append(group);
  return { group, box, text, shown: "" };
}

/** 12 345 is 12k: a badge has room for four characters. */
export function short(count: number): string {
  if (count < 10_000) return String(count);
  if (count < 1_000_000) return `${Math.floor(count / 1000)}k`;
  return `${(count / 1_000_000).toFixed(count < 10_000_000 ? 1 : 0)}M`;
}
