// The search of the menus: what people mean comes before what is called so.
import search from "diagram-js/lib/features/search/search";
import type { FragmentKind, Options } from "./fragments";
import { intentsOf } from "./intents";

/** Of the entries of blocks. */
export const BLOCK_CLASS = "m2-block-entry";

interface Intended {
  kind: FragmentKind;
  /** The entry with what the search says about it. */
  withOptions(options: Options): object;
}

const intended = new WeakMap<object, Intended>();

/** Marks an entry by its action: the menu makes copies of its entries. */
export function intendedEntry<Entry extends { action: object }>(
  entry: Entry,
  kind: FragmentKind,
  withOptions: (options: Options) => object,
): Entry {
  intended.set(entry.action, { kind, withOptions });
  return entry;
}

type Item = Record<string, string | string[]>;

export function searchByIntent(items: Item[], pattern: string, options: { keys: string[] }) {
  const plain = search(items, pattern, options);
  const meant = intentsOf(pattern).flatMap((intent) => {
    const item = items.find((each) => known(each)?.kind === intent.kind);
    return item ? [{ item, options: intent.options }] : [];
  });
  if (meant.length === 0) return plain;
  const taken = new Set(meant.map(({ item }) => item));
  const first = meant.map(({ item, options: said }) => ({ item: adjusted(item, said), tokens: {} }));
  const others = plain.filter(({ item }) => !taken.has(item));
  const isCalledSo = ({ item }: { item: Item }) => isCalled(item, pattern.trim().toLowerCase());
  return [
    ...others.filter(isCalledSo),
    ...first,
    ...others.filter((each) => !isCalledSo(each)),
  ];
}

/** Who knows what it is called gets it; of the fleet's blocks, the beginning is enough. */
function isCalled({ label, className }: Item, typed: string): boolean {
  const name = String(label).toLowerCase();
  return name === typed || (className === BLOCK_CLASS && name.startsWith(typed));
}

function known({ action }: Item): Intended | undefined {
  return action ? intended.get(action as unknown as object) : undefined;
}

function adjusted(item: Item, options: Options): Item {
  if (Object.keys(options).length === 0) return item;
  return { ...item, ...(known(item)?.withOptions(options) as Item) };
}
