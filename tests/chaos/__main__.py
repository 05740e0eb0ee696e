"""Play rounds of chaos, and print what came of each kill point.

python -m tests.chaos [--rounds 1000] [--seed N] [--vehicles NAME] [--journal NAME]
python -m tests.chaos --seed N --round K    # one round alone, kept in a folder
"""

import argparse
import random
import sys
import tempfile
import time
from pathlib import Path

from tests.chaos.kill_points import JOURNALS, SQLITE, points_of
from tests.chaos.rounds import Plan, Round, plan_round, play_round
from tests.chaos.table import as_table
from tests.chaos.worlds import WORLDS, SimulatedVehicles


def main() -> int:
    """Play rounds; 1 if the judge found a fault."""
    given = _arguments()
    if given.round is not None:
        return _one(given)
    print(f"seed {given.seed}", flush=True)
    began_s = time.monotonic()
    played: list[Round] = []
    for number in range(1, given.rounds + 1):
        played.append(play_round(_plan(given, number)))
        _say(played[-1], given)
    print(f"\n{as_table(played)}\n")
    wrong = [each.plan.number for each in played if each.verdict.faults]
    took_s = time.monotonic() - began_s
    print(f"{len(played)} rounds in {took_s:.0f} s; faults in {len(wrong)} of them: {wrong}")
    return 1 if wrong else 0


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.chaos", description=__doc__)
    parser.add_argument("--rounds", type=int, default=100)
    parser.add_argument("--seed", type=int, default=random.SystemRandom().randrange(10**6))
    parser.add_argument("--round", type=int, help="play this one alone")
    parser.add_argument("--vehicles", choices=list(WORLDS), default=SimulatedVehicles.name)
    parser.add_argument("--journal", choices=list(JOURNALS), default=SQLITE.name)
    points = {
        name: None
        for world in WORLDS.values()
        for journal in JOURNALS.values()
        for name in points_of(journal, world.arbiter)
    }
    parser.add_argument("--point", choices=list(points), default="", help="of the first kill")
    return parser.parse_args()


def _plan(given: argparse.Namespace, number: int) -> Plan:
    return plan_round(given.seed, number, given.vehicles, given.journal, given.point)


def _one(given: argparse.Namespace) -> int:
    folder = Path(tempfile.mkdtemp(prefix=f"m2pem-chaos-{given.round}-"))
    plan = _plan(given, given.round)
    played = play_round(plan, folder)
    print(plan)
    print(f"kills that happened: {played.reached}; {played.verdict}")
    print(f"its journal, what it printed and logged: {folder}")
    return 1 if played.verdict.faults else 0


def _say(played: Round, given: argparse.Namespace) -> None:
    if not played.verdict.faults:
        return
    print(played.plan)
    for fault in played.verdict.faults:
        print(f"  {fault}")
    point = f" --point '{given.point}'" if given.point else ""
    again = f"--seed {given.seed} --round {played.plan.number}"
    again += f" --vehicles {given.vehicles} --journal {given.journal}{point}"
    print(f"  again: python -m tests.chaos {again}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
