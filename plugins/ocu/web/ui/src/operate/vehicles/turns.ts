// Which cards are drawn again: of many, those in view each time, and the others in turn.
import type { RefObject } from "preact";
import { useEffect, useRef } from "preact/hooks";

/** So many are drawn each time, besides those in view. */
const AT_ONCE = 30;
/** Cards are in view a little before they are seen. */
const EARLY_PX = 200;

export class Turns {
  private next = 0;

  /** Whether each of `count` has its turn now. */
  take(count: number, isSeen: (index: number) => boolean): boolean[] {
    const from = this.next;
    this.next = count > AT_ONCE ? (from + AT_ONCE) % count : 0;
    return Array.from(
      { length: count },
      (_, index) => isSeen(index) || (index - from + count) % count < AT_ONCE,
    );
  }
}

/** The places in a list of those that are in view, kept up to date. */
export function useSeen(list: RefObject<HTMLElement>, count: number): ReadonlySet<number> {
  const seen = useRef(new Set<number>());
  useEffect(() => {
    seen.current.clear();
    const all = [...(list.current?.children ?? [])];
    const places = new Map(all.map((each, index) => [each, index]));
    const observer = new IntersectionObserver(
      (changes) => {
        for (const { target, isIntersecting } of changes) {
          const index = places.get(target)!;
          if (isIntersecting) seen.current.add(index);
          else seen.current.delete(index);
        }
      },
      { rootMargin: `${EARLY_PX}px` },
    );
    for (const each of all) observer.observe(each);
    return () => observer.disconnect();
  }, [count]);
  return seen.current;
}
