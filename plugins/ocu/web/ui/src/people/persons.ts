// Of what pages and terminals announce: the persons behind them.
export interface Presence {
  by: string;
  unit: string;
  role: string;
  run: string;
  page: string;
  since_us: number;
}

/** One line a person: of several pages of one, the one that watches a run. */
export function persons(all: readonly Presence[]): Presence[] {
  const found = new Map<string, Presence>();
  for (const each of all) {
    const known = found.get(each.by);
    if (!known || (!known.run && each.run)) found.set(each.by, each);
  }
  return [...found.values()];
}
