// Who has the vehicles that a mission needs, as it stands now.

/** `run` "": an operator has it by hand. `task`: in words; "": no task of the run has it now. */
export interface Standing {
  resource: string;
  who: string;
  run: string;
  task: string;
  free: boolean;
}

const RUN = /^r[1-9][0-9]*$/;
/** r1.b3, r1.a2, r1.i1: a behavior, a request or an incident of a run. */
const OF_RUN = /^(r[1-9][0-9]*)\.[a-z]+\d+$/;

/**
 * `refused`: by resource, the run or operator that had it when the start was refused. `holders`:
 * who has each now; null: not known yet. `labels`: tasks in words. `stopped`: runs that were
 * stopped since, whose vehicles are free as soon as nothing has them.
 */
export function standing(
  refused: Record<string, string>,
  holders: Record<string, string> | null,
  labels: Record<string, string>,
  stopped: readonly string[],
): Standing[] {
  return Object.entries(refused).map(([resource, had]) => {
    const holder = holders?.[resource] ?? "";
    const run = OF_RUN.exec(holder)?.[1] ?? (holder ? "" : RUN.test(had) ? had : "");
    const who = run || holder || had;
    // A run that names a vehicle may command it later, also where none of its tasks has it now.
    const left = had === "" || stopped.includes(had) || !RUN.test(had);
    return {
      resource,
      who,
      run,
      task: labels[holder] ?? "",
      free: holders !== null && holder === "" && left,
    };
  });
}
