// Where the palette has no room and is scrolled, as on a phone, it can be scrolled with the keyboard.
import { strings } from "../../strings";

/** Follows its size until what it gives is called. */
export function followPalette(container: Element): () => void {
  const palette = container.querySelector<HTMLElement>(".djs-palette");
  if (!palette) return () => undefined;
  palette.setAttribute("role", "group");
  palette.setAttribute("aria-label", strings.editor.reading.palette);
  const observer = new ResizeObserver(() => {
    const { scrollWidth, clientWidth, scrollHeight, clientHeight } = palette;
    const isCut = scrollWidth > clientWidth || scrollHeight > clientHeight;
    if (isCut && getComputedStyle(palette).overflow !== "visible") palette.tabIndex = 0;
    else palette.removeAttribute("tabindex");
  });
  for (const each of [palette, ...palette.children]) observer.observe(each);
  return () => observer.disconnect();
}
