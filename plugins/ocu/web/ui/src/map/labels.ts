// Which labels on a map have room, so that none lies on another.

export interface Label {
  element: HTMLElement;
  /** Whether it is shown even where it lies on another one. */
  stays?: boolean;
}

/**
 * Mark with a class the labels that lie on one before them, the others not. `taken`: places where
 * no label may be.
 */
export function markCrowded(
  labels: readonly Label[],
  className: string,
  taken: readonly DOMRect[] = [],
): void {
  for (const { element } of labels) element.classList.remove(className);
  // All are measured before any is marked: the browser lays the page out once.
  const boxes = labels.map(({ element }) => element.getBoundingClientRect());
  const kept = [...taken];
  labels.forEach(({ element, stays = false }, index) => {
    const box = boxes[index]!;
    const hasRoom = !kept.some((other) => overlaps(box, other));
    element.classList.toggle(className, !hasRoom && !stays);
    if (hasRoom) kept.push(box);
  });
}

const overlaps = (one: DOMRect, other: DOMRect): boolean =>
  one.left < other.right &&
  other.left < one.right &&
  one.top < other.bottom &&
  other.top < one.bottom;
