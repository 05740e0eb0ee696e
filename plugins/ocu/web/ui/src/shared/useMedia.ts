// Whether a condition on the window holds, such as its width, which is given at the usual text size.
import { useEffect, useState } from "preact/hooks";
import { textScale } from "./textScale";

/** The query at a text size: with larger texts, a window has less room. */
export const atScale = (query: string, scale: number): string =>
  query.replace(/(\d+)px/g, (_whole, px: string) => `${Number(px) * scale}px`);

export function useMedia(query: string): boolean {
  const now = atScale(query, textScale.value);
  const [, renew] = useState(0);
  useEffect(() => {
    const media = matchMedia(now);
    const changed = () => renew((count) => count + 1);
    media.addEventListener("change", changed);
    return () => media.removeEventListener("change", changed);
  }, [now]);
  return matchMedia(now).matches;
}
