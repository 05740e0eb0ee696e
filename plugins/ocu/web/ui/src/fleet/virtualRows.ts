// Which lines of a long table are drawn: those that are seen, and a few around them.

/** Lines above and below what is seen: while one scrolls, none is missing. */
const AROUND = 8;

export interface Window {
  from: number;
  /** Exclusive. */
  to: number;
}

export function windowOf(
  count: number,
  { scrolled_px, seen_px, line_px }: { scrolled_px: number; seen_px: number; line_px: number },
): Window {
  const first = Math.floor(scrolled_px / line_px) - AROUND;
  const last = Math.ceil((scrolled_px + seen_px) / line_px) + AROUND;
  const from = Math.max(0, Math.min(first, count));
  return { from, to: Math.max(from, Math.min(last, count)) };
}

/** How far to scroll so that a line is seen whole. `head_px`: what covers the top. */
export function scrolledTo(
  line: number,
  {
    scrolled_px,
    seen_px,
    line_px,
    head_px,
  }: { scrolled_px: number; seen_px: number; line_px: number; head_px: number },
): number {
  const top = line * line_px;
  const bottom = top + line_px - (seen_px - head_px);
  return Math.max(Math.min(scrolled_px, top), bottom);
}
