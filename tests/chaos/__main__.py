"""Play rounds of chaos, and print what came of each kill point.

python -m tests.chaos [--rounds 1000] [--seed N] [--vehicles NAME] [--journal NAME]
python -m tests.chaos --stop [--trouble NAME]  # an operator stops all, while something is wrong
python -m tests.chaos --seed N --round K    # one round alone, kept in a folder
"""

import argparse
import random
import sys
import tempfile
import time
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from tests.chaos.kill_points import JOURNALS, REPLACED, SQLITE, points_of
from tests.chaos.rounds import Plan, Round, plan_round, play_round
from tests.chaos.stops import StopRound, plan_stop, play_stop
from tests.chaos.stops import as_table as stops_as_table
from tests.chaos.table import as_table
from tests.chaos.troubles import NONE, TROUBLES
from tests.chaos.worlds import OF_ROS, WORLDS, SimulatedVehicles


def main() -> int:
    """Play rounds; 1 if the judge found a fault."""
    given = _arguments()
    if given.round is not None:
        return _one(given)
    print(f"seed {given.seed}", flush=True)
    began_s = time.monotonic()
    if given.stop:
        stops = [_play_stop(given, number) for number in range(1, given.rounds + 1)]
        print(f"\n{stops_as_table(stops)}\n")
        played: Sequence[Round | StopRound] = stops
    else:
        rounds = [_play(given, number) for number in range(1, given.rounds + 1)]
        print(f"\n{as_table(rounds)}\n")
        played = rounds
    wrong = [each.plan.number for each in played if each.verdict.faults]
    took_s = time.monotonic() - began_s
    names = f": {', '.join(map(str, wrong))}" if wrong else ""
    print(f"{len(played)} rounds in {took_s:.0f} s; faults in {len(wrong)} of them{names}")
    return 1 if wrong else 0


def _play(given: argparse.Namespace, number: int, folder: Path | None = None) -> Round:
    played = play_round(_plan(given, number), folder)
    _say(played, given)
    return played


def _play_stop(given: argparse.Namespace, number: int, folder: Path | None = None) -> StopRound:
    plan = plan_stop(given.seed, number, given.vehicles, given.journal, given.trouble)
    played = play_stop(plan, folder)
    _say(played, given)
    return played


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
    parser.add_argument(
        "--point", choices=[REPLACED, *points], default="", help="of the first kill"
    )
    parser.add_argument("--stop", action="store_true", help="stop all, while something is wrong")
    parser.add_argument("--trouble", choices=list(TROUBLES), default="", help="what is wrong then")
    given = parser.parse_args()
    if given.vehicles in OF_ROS and not find_spec("rclpy"):
        parser.error(f"--vehicles {given.vehicles}: ROS 2 is not here; .venv-ros/bin/python has it")
    if given.stop and given.vehicles not in NONE.worlds:
        parser.error(f"--stop: --vehicles is one of {', '.join(NONE.worlds)}")
    return given


def _plan(given: argparse.Namespace, number: int) -> Plan:
    return plan_round(given.seed, number, given.vehicles, given.journal, given.point)


def _one(given: argparse.Namespace) -> int:
    folder = Path(tempfile.mkdtemp(prefix=f"m2pem-chaos-{given.round}-"))
    play = _play_stop if given.stop else _play
    played = play(given, given.round, folder)
    print(played)
    print(f"its journal, what it printed and logged: {folder}")
    return 1 if played.verdict.faults else 0


def _say(played: Round | StopRound, given: argparse.Namespace) -> None:
    if not played.verdict.faults:
        return
    print(played.plan)
    for fault in played.verdict.faults:
        print(f"  {fault}")
    point = f" --point '{given.point}'" if given.point else ""
    point += " --stop" if given.stop else ""
    point += f" --trouble '{given.trouble}'" if given.trouble else ""
    again = f"--seed {given.seed} --round {played.plan.number}"
    again += f" --vehicles {given.vehicles} --journal {given.journal}{point}"
    print(f"  again: python -m tests.chaos {again}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
