"""Rehearses one mission with many batteries, on all processors."""

from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import m2pem
from m2pem.engine.records import BehaviorEnded, BehaviorRequested
from m2pem.fleet.fleet import Fleet
from m2pem.mission.catalogue import ResourceId

HERE = Path(__file__).parent
PERCENT = range(10, 101, 10)


def with_battery(fleet: Fleet, vehicle: ResourceId, percent: int) -> Fleet:
    """The fleet, with another battery in one vehicle. A fleet never changes; this is a new one."""
    old = fleet.vehicles[vehicle]
    new = replace(old, settings={**old.settings, "battery": f"{percent} %"})
    return replace(fleet, vehicles={**fleet.vehicles, vehicle: new})


def rehearsed(percent: int) -> str:
    """One rehearsal, as a line of the table."""
    fleet = with_battery(m2pem.load_fleet(HERE / "fleet.yaml"), ResourceId("uav1"), percent)
    result = m2pem.rehearse(HERE / "mission.bpmn", fleet)
    who: dict[str, str] = {}
    by = "none"
    for stamped in result.records:
        match stamped.record:
            case BehaviorRequested() as begun:
                who[begun.behavior] = ", ".join(begun.resources)
            case BehaviorEnded(code="") as ended:
                by = who[ended.behavior]
            case _:
                pass
    return f"{percent:6} %  {result.outcome:10} {by:8} {result.records[-1].t_s:6.1f} s"


def main() -> None:
    """Print a line for each battery."""
    print("battery  outcome    surveyed by  after")
    with ProcessPoolExecutor() as pool:
        for line in pool.map(rehearsed, PERCENT):
            print(line)


if __name__ == "__main__":
    main()
