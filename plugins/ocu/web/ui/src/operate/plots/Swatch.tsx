// A piece of the line of a vehicle or payload.
import { means, swatchOf } from "./style";

export function Swatch({ index }: { index: number }) {
  const { colour, dash, width } = swatchOf(index, means.value);
  return (
    <svg class="swatch" width="22" height="8" aria-hidden="true">
      <line
        x1="0"
        x2="22"
        y1="4"
        y2="4"
        style={{ stroke: colour, strokeWidth: width, strokeDasharray: dash }}
      />
    </svg>
  );
}
