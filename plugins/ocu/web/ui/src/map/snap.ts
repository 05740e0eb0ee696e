// A vertex that is put down near another one goes onto it.
import type { Vertex } from "./draft";

export interface Pixel {
  x: number;
  y: number;
}

/** So near, in pixels. */
export const SNAP_PX = 12;

/** The nearest of the others that is near enough; the vertex itself if none is. */
export function snapped(
  vertex: Vertex,
  others: Iterable<Vertex>,
  pixelOf: (vertex: Vertex) => Pixel,
  within_px = SNAP_PX,
): Vertex {
  const at = pixelOf(vertex);
  let [nearest, least] = [vertex, within_px];
  for (const other of others) {
    const { x, y } = pixelOf(other);
    const far = Math.hypot(x - at.x, y - at.y);
    if (far > least) continue;
    [nearest, least] = [{ ...other, altitude: vertex.altitude }, far];
  }
  return nearest;
}
