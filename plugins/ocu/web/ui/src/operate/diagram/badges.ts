// Numbers at the corners of elements: how often a token came, how many are there now; and a sign for
// what failed or asks. Renewed a few times a second: nobody reads faster.
import type { ElementState } from "../../shared/types";
import type { Outline } from "./painter";

const SVG = "http://www.w3.org/2000/svg";
const RENEWED_MS = 250;
const HEIGHT = 16;
const DIGIT = 6.6;

interface Badge {
  group: SVGElement;
  box: SVGElement;
  text: SVGElement;
  shown: string;
}

type Corner = "hits" | "tokens" | "sign";

interface Waiting {
  gfx: SVGElement;
  outline: Outline;
  state: ElementState;
}

export class Badges {
  private readonly badges = new Map<string, Badge>();
  private readonly waiting = new Map<string, Waiting>();
  private timer: ReturnType<typeof setTimeout> | undefined;

  set(key: string, gfx: SVGElement, outline: Outline, state: ElementState): void {
    this.waiting.set(key, { gfx, outline, state });
    this.timer ??= setTimeout(() => this.renew(), RENEWED_MS);
  }

  dispose(): void {
    clearTimeout(this.timer);
  }

  private renew(): void {
    this.timer = undefined;
    for (const [key, { gfx, outline, state }] of this.waiting) {
      this.write(`${key}\nhits`, gfx, outline, "hits", state.hits > 1 ? short(state.hits) : "");
      const tokens = state.active > 1 ? `● ${short(state.active)}` : "";
      this.write(`${key}\ntokens`, gfx, outline, "tokens", tokens);
      const sign = state.asking ? "?" : state.failed && state.active === 0 ? "✕" : "";
      this.write(`${key}\nsign`, gfx, outline, "sign", sign);
    }
    this.waiting.clear();
  }

  private write(key: string, gfx: SVGElement, outline: Outline, corner: Corner, text: string): void {
    let badge = this.badges.get(key);
    if (!badge && text === "") return;
    if (!badge) this.badges.set(key, (badge = make(gfx, corner)));
    if (badge.shown === text) return;
    badge.shown = text;
    badge.group.setAttribute("display", text === "" ? "none" : "inline");
    if (text === "") return;
    const width = Math.max(HEIGHT, text.length * DIGIT + 9);
    const x = corner === "sign" ? -7 : outline.width - width + 7;
    const y = corner === "tokens" ? outline.height - HEIGHT / 2 : -HEIGHT / 2;
    badge.group.setAttribute("transform", `translate(${x} ${y})`);
    badge.box.setAttribute("width", String(width));
    badge.text.setAttribute("x", String(width / 2));
    badge.text.textContent = text;
  }
}

function make(gfx: SVGElement, corner: Corner): Badge {
  const group = document.createElementNS(SVG, "g");
  group.setAttribute("class", `m2-badge m2-badge-${corner}`);
  const box = document.createElementNS(SVG, "rect");
  box.setAttribute("height", String(HEIGHT));
  box.setAttribute("rx", String(HEIGHT / 2));
  const text = document.createElementNS(SVG, "text");
  text.setAttribute("y", "12");
  text.setAttribute("text-anchor", "middle");
  group.append(box, text);
  gfx.append(group);
  return { group, box, text, shown: "" };
}

/** 12 345 is 12k: a badge has room for four characters. */
export function short(count: number): string {
  if (count < 10_000) return String(count);
  if (count < 1_000_000) return `${Math.floor(count / 1000)}k`;
  return `${(count / 1_000_000).toFixed(count < 10_000_000 ? 1 : 0)}M`;
}
