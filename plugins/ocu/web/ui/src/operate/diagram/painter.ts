// Colours of the elements of one drawn diagram, on a canvas of their own that is multiplied with
// the drawing. The drawing itself is never touched for them: to repaint hundreds of SVG shapes
// while they fade is too slow, to fill as many rectangles is not.
import type { Colour, Look, Palette } from "./colours";

export interface Outline {
  x: number;
  y: number;
  width: number;
  height: number;
  kind: "circle" | "diamond" | "box" | "frame";
  /** Lies on the border of another one, and hides its colour, whatever its own. */
  above: boolean;
}

export interface Painted {
  outline: Outline;
  look: Look;
  /** When it was left, by performance.now(); it fades from then on. */
  left_ms: number;
}

export interface Window {
  x: number;
  y: number;
  scale: number;
}

const CORNER = 10;
const SELECTED = "#0b63ce";
/** Of a colour that fades: nobody sees these steps, and each draws the whole canvas. */
const FADE_STEPS = 50;
const LEAST_STEP_MS = 50;

export class Painter {
  private readonly painted = new Map<string, Painted>();
  private above: readonly Outline[] = [];
  private selected: Outline | undefined;
  private surrounded: readonly Outline[] = [];
  private readonly pen: CanvasRenderingContext2D;
  private frame = 0;
  private step: ReturnType<typeof setTimeout> | undefined;
  private drawn_ms = 0;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private window: Window,
    private palette: Palette,
    private fading_ms: number,
  ) {
    this.pen = canvas.getContext("2d")!;
  }

  set(key: string, painted: Painted): void {
    if (painted.look === "idle") this.painted.delete(key);
    else this.painted.set(key, painted);
    this.soon();
  }

  /** Begin another drawing. `above`: all that lies on borders in it. */
  clear(above: readonly Outline[]): void {
    this.painted.clear();
    this.above = above;
    this.selected = undefined;
    this.surrounded = [];
    this.soon();
  }

  /** `others`: what is surrounded, too, by a broken line. */
  select(outline: Outline | undefined, others: readonly Outline[] = []): void {
    this.selected = outline;
    this.surrounded = others;
    this.soon();
  }

  show(palette: Palette, fading_ms: number): void {
    this.palette = palette;
    this.fading_ms = fading_ms;
    this.soon();
  }

  /** The drawing was moved or zoomed: at once, or the colours lag behind it. */
  look(window: Window): void {
    this.window = window;
    this.draw();
  }

  resize(width: number, height: number): void {
    this.canvas.width = Math.round(width * devicePixelRatio);
    this.canvas.height = Math.round(height * devicePixelRatio);
    this.draw();
  }

  dispose(): void {
    cancelAnimationFrame(this.frame);
    clearTimeout(this.step);
  }

  private soon(): void {
    if (this.frame === 0) this.frame = requestAnimationFrame(() => this.tick());
  }

  private tick(): void {
    this.frame = 0;
    this.draw();
    clearTimeout(this.step);
    if (!this.fades(this.drawn_ms)) return;
    const step_ms = Math.max(LEAST_STEP_MS, this.fading_ms / FADE_STEPS);
    this.step = setTimeout(() => this.soon(), step_ms);
  }

  private fades(now: number): boolean {
    for (const { look, left_ms } of this.painted.values()) {
      if (look === "done" && now - left_ms < this.fading_ms) return true;
    }
    return false;
  }

  private draw(): void {
    const { pen, canvas, window } = this;
    this.drawn_ms = performance.now();
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, canvas.width, canvas.height);
    const scale = window.scale * devicePixelRatio;
    pen.setTransform(scale, 0, 0, scale, -window.x * scale, -window.y * scale);
    for (const painted of this.painted.values()) if (!painted.outline.above) this.fill(painted);
    for (const outline of this.above) this.punch(outline);
    for (const painted of this.painted.values()) if (painted.outline.above) this.fill(painted);
    for (const outline of this.surrounded) {
      if (outline !== this.selected) this.surround(outline, [7, 5]);
    }
    if (this.selected) this.surround(this.selected);
  }

  private fill({ outline, look, left_ms }: Painted): void {
    if (look === "idle") return;
    const { pen } = this;
    const colour = this.palette[look];
    trace(pen, outline);
    if (outline.kind !== "frame") {
      pen.fillStyle = look === "done" ? this.faded(left_ms) : rgb(colour.fill);
      pen.fill();
    }
    if (colour.width > 0) this.ring(colour);
  }

  /** Around what is selected. */
  private surround({ x, y, width, height }: Outline, dash: number[] = []): void {
    const { pen } = this;
    pen.strokeStyle = SELECTED;
    pen.lineWidth = 3;
    pen.setLineDash(dash);
    pen.beginPath();
    pen.roundRect(x - 7, y - 7, width + 14, height + 14, CORNER);
    pen.stroke();
  }

  private punch(outline: Outline): void {
    const { pen } = this;
    trace(pen, outline);
    pen.globalCompositeOperation = "destination-out";
    pen.fill();
    pen.globalCompositeOperation = "source-over";
  }

  private ring({ ring, dash, width }: Colour): void {
    const { pen } = this;
    pen.strokeStyle = ring;
    pen.lineWidth = width;
    pen.setLineDash(dash);
    pen.stroke();
  }

  /** From green to gray, slower towards the end. */
  private faded(left_ms: number): string {
    const { active, done } = this.palette;
    const part = this.fading_ms > 0 ? Math.min(1, (this.drawn_ms - left_ms) / this.fading_ms) : 1;
    const eased = 1 - (1 - part) ** 2;
    const mix = (index: 0 | 1 | 2) =>
      Math.round(active.fill[index] + (done.fill[index] - active.fill[index]) * eased);
    return rgb([mix(0), mix(1), mix(2)]);
  }
}

const rgb = ([red, green, blue]: Colour["fill"]): string => `rgb(${red},${green},${blue})`;

function trace(pen: CanvasRenderingContext2D, { x, y, width, height, kind }: Outline): void {
  const [middleX, middleY] = [x + width / 2, y + height / 2];
  pen.beginPath();
  switch (kind) {
    case "circle":
      pen.arc(middleX, middleY, width / 2, 0, 2 * Math.PI);
      break;
    case "diamond":
      pen.moveTo(middleX, y);
      pen.lineTo(x + width, middleY);
      pen.lineTo(middleX, y + height);
      pen.lineTo(x, middleY);
      pen.closePath();
      break;
    default:
      pen.roundRect(x, y, width, height, CORNER);
  }
}
