// All of a diagram in the window, beside the palette and above the bpmn.io mark.
import type { Canvas } from "./services";

const FREE = { left: 124, right: 28, top: 28, bottom: 48 };
const CLOSEST = 1;

export function fitTo(canvas: Canvas): void {
  const { inner, outer } = canvas.viewbox();
  const width = outer.width - FREE.left - FREE.right;
  const height = outer.height - FREE.top - FREE.bottom;
  if (width <= 0 || height <= 0 || inner.width === 0) return;
  const scale = Math.min(CLOSEST, width / inner.width, height / inner.height);
  const spareX = Math.max(0, width - inner.width * scale) / 2;
  const spareY = Math.max(0, height - inner.height * scale) / 2;
  canvas.viewbox({
    x: inner.x - (FREE.left + spareX) / scale,
    y: inner.y - (FREE.top + spareY) / scale,
    width: outer.width / scale,
    height: outer.height / scale,
  });
}
