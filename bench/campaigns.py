"""How fast campaigns are: `python -m bench.campaigns [RUNS [WORKERS]]` prints a table.

The mission is VIGNETTE1 with its own fleet. First runs in one process, by the CPU that they take:
as it is, and with what is drawn: a failure of its route, when its detector finds something,
decisions, a link that breaks, and the battery. Then a whole campaign in a pool, by the clock on the
wall.
"""

import math
import sys
import time
from pathlib import Path

from m2pem.campaign.campaign import CampaignResult, run_campaign
from m2pem.campaign.runs import Order, order_of, rehearse_runs
from m2pem.executive.loading import load_source
from m2pem.fleet.fleet_file import load_fleet

ROOT = Path(__file__).parents[1]
VARIATIONS = b"""
behaviors:
  DriveRoute: {fails: {probability: 0.05, after: 5..60 s, error: ROUTE_BLOCKED}}
services:
  Detector:
    after: {exponential: 40 s}
    write: [{weight: 3, data: {detection.type: camera}}, {data: {detection.type: gpr}}]
answers: {UserSendRoute: {continue: 3, abort: 1}}
links: [{vehicle: evsg1, at: 0..100 s, for: {exponential: 5 s}, probability: 0.1}]
vehicles: {evsg1: {battery: 50 %..100 %}}
"""
ROUNDS, A_ROUND = 10, 50


def main() -> None:
    """Print the table."""
    runs = int(sys.argv[1]) if sys.argv[1:] else 10_000
    workers = int(sys.argv[2]) if sys.argv[2:] else 2
    mission = load_source(ROOT / "missions" / "vignette1.bpmn")
    fleet = load_fleet(ROOT / "fleet_configs" / "vignette1.yaml")
    order = order_of(mission, fleet, VARIATIONS, 7)
    print("| | |\n|---|---|")
    for name, each in (("as it is", order_of(mission, fleet, b"", 7)), ("drawn", order)):
        said = f"one process, {name}: runs in a second of CPU, best of {ROUNDS} rounds"
        print(f"| {said} | {1 / alone(each):,.0f} |")
    begun_s = time.monotonic()
    result = run_campaign(order, runs, workers=workers)
    wall_s = time.monotonic() - begun_s
    print(f"| {runs:,} runs, {workers} workers: s | {wall_s:.1f} |")
    print(f"| runs in a second | {runs / wall_s:,.0f} |")
    print(f"| times faster than real time | {mission_s(result) / wall_s:,.0f} |")


def alone(order: Order) -> float:
    """CPU seconds of a run in this process."""
    rehearse_runs(order, range(A_ROUND))
    best = float("inf")
    for number in range(ROUNDS):
        begun_s = time.process_time()
        rehearse_runs(order, range(number * A_ROUND, (number + 1) * A_ROUND))
        best = min(best, (time.process_time() - begun_s) / A_ROUND)
    return best


def mission_s(result: CampaignResult) -> float:
    """Seconds of mission time of all runs."""
    return math.fsum(row["took_s"] for row in result.rows if not row["error"])


if __name__ == "__main__":
    main()
