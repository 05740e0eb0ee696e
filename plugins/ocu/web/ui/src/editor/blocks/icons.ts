// Pictures of the kinds of blocks, 24 by 24, drawn with one path each.
import type { BlockGroup } from "./blocks";

export const ICONS: Record<BlockGroup, string> = {
  control:
    "M3 11h4l5-5 5 5h4v2h-4l-5 5-5-5H3zM12 8.800L8.800 12l3.200 3.200 3.200-3.200z",
  ground:
    "M3 16v-4l2-1 3-5h7l4 5 2 1v4h-2a2.5 2.5 0 0 1-5 0H10a2.5 2.5 0 0 1-5 0zM9 8l-2 3h4V8zm4 0v3h4l-2-3z",
  air: "M5 4a3 3 0 0 1 3 3l2 2h4l2-2a3 3 0 1 1 2 2l-2 2v2l2 2a3 3 0 1 1-2 2l-2-2h-4l-2 2a3 3 0 1 1-2-2l2-2v-2L6 9.800A3 3 0 1 1 5 4z",
  surface:
    "M12 3v7h6l2 1-3 6H7l-3-6 2-1h4V5zM3 19c2 0 2 1 4.500 1s2.500-1 4.500-1 2 1 4.500 1 2.500-1 4.500-1v2c-2 0-2 1-4.500 1s-2.500-1-4.500-1-2 1-4.500 1S5 21 3 21z",
  subsurface:
    "M11 5h3v3h1a6 4 0 0 1 6 4 6 4 0 0 1-6 4H8a5 4 0 0 1-4-2l-2 2V8l2 2a5 4 0 0 1 4-2h3zM9 11a1.200 1.200 0 1 0 .01 0zm5 0a1.200 1.200 0 1 0 .01 0z",
  payload:
    "M9 5h6l1.500 2H20a1 1 0 0 1 1 1v10a1 1 0 0 1-1 1H4a1 1 0 0 1-1-1V8a1 1 0 0 1 1-1h3.500zM12 9a4 4 0 1 0 .01 0zm0 2a2 2 0 1 1-.01 0z",
  team: "M12 3l3 5H9zM6 11l3 5H3zm12 0l3 5h-6zM8 18h8v2H8z",
  service:
    "M10 3h4l.5 2.500 1.800.8 2.200-1.300 2.500 2.800-1.600 2 .3 1.900 2.300 1-.9 3.600-2.600.2-1.200 1.500.4 2.500-3.400 1.500-1.700-2h-1.200l-1.700 2-3.400-1.500.4-2.500L5 16.500l-2.600-.2L1.500 12.700l2.300-1 .3-1.900-1.600-2L5 5l2.200 1.300L9 5.500zM12 9a3 3 0 1 0 .01 0z",
  operator: "M12 3a4 4 0 1 1-.01 0zM4 20c0-4 3.500-6.500 8-6.500s8 2.500 8 6.500v1H4z",
};

/** Contrast with white is at least 4.5 : 1. */
export const COLORS: Record<BlockGroup, string> = {
  control: "#3d4a57",
  ground: "#1f6f4a",
  air: "#0b5cad",
  surface: "#00697a",
  subsurface: "#34508b",
  payload: "#7a3fb0",
  team: "#8a4b00",
  service: "#52606d",
  operator: "#9a2c5b",
};

export function iconSvg(group: BlockGroup, size = 20): string {
  return (
    `<svg viewBox="0 0 24 24" width="${size}" height="${size}" aria-hidden="true" ` +
    `focusable="false"><path fill="${COLORS[group]}" fill-rule="evenodd" d="${ICONS[group]}"/></svg>`
  );
}
