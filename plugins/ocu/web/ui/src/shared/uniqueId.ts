// Preact's useId counts from the beginning in each tree that is rendered, as in that of each dialog: two elements
// of the page could have the same id.
import { useState } from "preact/hooks";

let given = 0;

/** An id that no other element of the page has. */
export function useUniqueId(): string {
  const [id] = useState(() => `unique-${(given += 1)}`);
  return id;
}
