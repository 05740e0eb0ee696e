// The points of a vehicle's trail, as a map draws them: added one by one, in pieces.
import { isGap } from "../operate/map/trail";

/** A vehicle that has gone less far is where it was. */
const STEP_M = 1;

/** In pixels of the whole world at zoom 0. */
export type WorldPoint = readonly [number, number];

export class TrailPoints {
  /** x and y in turn. */
  readonly pieces: number[][] = [];
  private count = 0;

  constructor(private readonly most: number) {}

  /** All of it, drawn again. */
  replace(pieces: readonly (readonly WorldPoint[])[]): void {
    this.pieces.length = 0;
    this.count = 0;
    for (const piece of pieces) {
      if (piece.length === 0) continue;
      this.pieces.push(piece.flat());
      this.count += piece.length;
    }
  }

  /**
   * Go on to a point, `since_s` after the last one; after a gap, with a new piece. Returns where the line to it begins, if there
   * is one to draw.
   */
  extend(
    to: WorldPoint,
    metres_per_px: number,
    since_s: number,
    longest_s: number,
  ): WorldPoint | null {
    const last = this.pieces.at(-1);
    const step_m = last
      ? Math.hypot(to[0] - last.at(-2)!, to[1] - last.at(-1)!) * metres_per_px
      : Infinity;
    if (step_m < STEP_M) return null;
    this.count += 1;
    if (!last || isGap(since_s, step_m, longest_s)) {
      this.pieces.push([...to]);
      return null;
    }
    const from: WorldPoint = [last.at(-2)!, last.at(-1)!];
    last.push(...to);
    return from;
  }

  /** Leave out the oldest, if there are more than a map draws. Returns whether there were. */
  trim(): boolean {
    if (this.count <= this.most) return false;
    while (this.count > this.most * 0.75) {
      const oldest = this.pieces[0]!;
      const drop = Math.min(oldest.length / 2, Math.ceil(this.count - this.most * 0.75));
      this.count -= drop;
      if (drop * 2 === oldest.length) this.pieces.shift();
      else oldest.splice(0, drop * 2);
    }
    return true;
  }
}
