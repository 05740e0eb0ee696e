// Of what pages and terminals announce: the persons behind them.
export interface Presence {
  by: string;
  unit: string;
  role: string;
  run: string;
  page: string;
  since_us: number;
  editing: string;
}

/** The person behind the name of an operator, as the executive compares them: anna@gcs1 and Anna
 * are one. */
export const personOf = (name: string): string =>
  name.normalize("NFKC").split("@")[0]!.trim().toLowerCase();

/** One line a person: of several pages of one, the one that watches a run or edits a mission. */
export function persons(all: readonly Presence[]): Presence[] {
  const found = new Map<string, Presence>();
  for (const each of all) {
    const known = found.get(personOf(each.by));
    if (!known || (!isAtWork(known) && isAtWork(each))) found.set(personOf(each.by), each);
  }
  return [...found.values()];
}

const isAtWork = ({ run, editing }: Presence): boolean => run !== "" || editing !== "";

/** Who else edits a mission, by name. */
export function othersEditing(all: readonly Presence[], mission: string, user: string): string[] {
  const others = all.filter(
    ({ by, editing }) => editing === mission && personOf(by) !== personOf(user),
  );
  return [...new Set(others.map(({ by }) => by))];
}
