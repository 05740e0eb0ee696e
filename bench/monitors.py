"""What monitors of requirements cost: CPU of the engine, and of whole rehearsals, with 0 and 20.

`python -m bench.monitors` prints a table. The mission is `missions/survey_pair.bpmn`; its 20
requirements are those of docs/requirements.md and more of their kind. Rounds with and without take
turns, and the least time of each counts.
"""

import time
from collections.abc import Callable
from pathlib import Path
from xml.sax.saxutils import quoteattr

from m2pem.bpmn import parse_mission, read_mission
from m2pem.engine.inputs import BehaviorReported, Input, MonitoredRequirement, StartRun
from m2pem.engine.run import MissionRun
from m2pem.engine.state import RunStatus
from m2pem.fleet.fleet_file import load_fleet
from m2pem.mission.catalogue import BehaviorState
from m2pem.monitors.run_monitors import RunMonitors
from m2pem.monitors.selection import monitored
from m2pem.plugins import PluginManager
from m2pem.rehearsal.rehearsal import rehearse
from m2pem.verify.requirements import Names, parse_spec

ROOT = Path(__file__).parents[1]
MISSION = read_mission(ROOT / "missions" / "survey_pair.bpmn")
FLEET = load_fleet(ROOT / "fleet_configs" / "survey_pair.yaml")
START_US = 1_767_225_600_000_000
RUNS, ROUNDS, REHEARSALS = 200, 7, 20
PLUGINS = PluginManager()

_FORMULAS = (
    "[](completed(ReturnUav1) -> [] !commanded(uav1))",
    "[](completed(ReturnUav2) -> [] !commanded(uav2))",
    "[](completed(ReturnRover) -> [] !commanded(rover1))",
    "[](active(TakeOverWest) -> !once(completed(SurveyWest)))",
    "<> completed(SurveyWest)",
    "<> completed(SurveyEast)",
    "[] !(active(SurveyWest) && active(TakeOverWest))",
    "!active(SurveyWest) W completed(TakeoffUav1)",
    "!active(SurveyEast) W completed(TakeoffUav2)",
    "!active(ReturnUav1) W completed(SurveyWest)",
    "[](active(DriveToGate) -> <> completed(DriveToGate))",
    "[] count(active(SurveyWest)) <= 1",
    "[] count(active(SurveyEast)) <= 1",
    "[](commanded(uav1, area_survey) -> active(SurveyWest))",
    "[](commanded(uav2, takeoff) -> active(TakeoffUav2))",
    "<> ended(completed)",
    "[] !ended(failed)",
    "[](completed(TakeoffUav1) -> <>[0 s, 600 s] commanded(uav1, return_to_launch))",
    "[](completed(TakeoffUav2) -> <>[0 s, 600 s] commanded(uav2, return_to_launch))",
    "<>[0 s, 900 s] ended",
)


def requirements() -> tuple[MonitoredRequirement, ...]:
    """The 20 requirements."""
    entries = ", ".join(f'{{id: r{n}, ltl: "{each}"}}' for n, each in enumerate(_FORMULAS))
    spec = f"requirements: [{entries}]".encode()
    return monitored(parse_spec(spec, "bench.yaml", Names(MISSION, FLEET)))


def inputs(required: tuple[MonitoredRequirement, ...]) -> list[tuple[int, Input]]:
    """The inputs of a run in which every behavior succeeds, and their times."""
    run = MissionRun(MISSION, FLEET, "r1")
    now_us = START_US
    item: Input = StartRun("SURVEY_PAIR", requirements=required)
    found = []
    while True:
        found.append((now_us, item))
        run.receive(item, now_us)
        if run.state.status is RunStatus.ENDED:
            return found
        now_us += 10_000_000
        behavior = next(iter(run.state.behaviors.values()))
        item = BehaviorReported(behavior.id, 1, BehaviorState.SUCCEEDED)


def engine_s(required: tuple[MonitoredRequirement, ...]) -> tuple[float, int]:
    """CPU seconds of the engine, and the number of records, of `RUNS` runs."""
    given = inputs(required)
    records = 0
    begun_s = time.process_time()
    for _ in range(RUNS):
        run = MissionRun(MISSION, FLEET, "r1")
        monitors = RunMonitors(run.state, FLEET)
        for at_us, item in given:
            step = run.receive(item, at_us)
            records += len(step.records)
            monitors.observe(step.t_us, step.records)
            for verdict in monitors.take():
                decided = run.receive(verdict, at_us)
                monitors.observe(decided.t_us, decided.records)
    return time.process_time() - begun_s, records


def rehearsals_s(required: tuple[MonitoredRequirement, ...]) -> tuple[float, int]:
    """CPU seconds of rehearsals, and the number of their records."""
    mission = parse_mission(with_requirements(required), "survey_pair.bpmn")
    records = 0
    begun_s = time.process_time()
    for _ in range(REHEARSALS):
        records += len(rehearse(mission, FLEET, plugins=PLUGINS).records)
    return time.process_time() - begun_s, records


def with_requirements(required: tuple[MonitoredRequirement, ...]) -> bytes:
    """The mission's file with requirements in it."""
    inside = "".join(
        f"<m2pem:requirement id={quoteattr(each.id)} ltl={quoteattr(each.formula)}/>"
        for each in required
    )
    start = b'<bpmn:startEvent id="StartSurvey"'
    added = f"<bpmn:extensionElements>{inside}</bpmn:extensionElements>".encode()
    return MISSION.source.replace(start, added + start, 1)


def least(
    measure: Callable[[tuple[MonitoredRequirement, ...]], tuple[float, int]],
) -> tuple[float, float, int]:
    """The least time without and with monitors, and the records without."""
    without, with_, records = [], [], 0
    for _ in range(ROUNDS):
        seconds, records = measure(())
        without.append(seconds)
        with_.append(measure(requirements())[0])
    return min(without), min(with_), records


def main() -> None:
    """Print the table."""
    without, with_, records = least(engine_s)
    print("| engine alone | 0 monitors | 20 monitors | more |")
    print("|---|---|---|---|")
    print(
        f"| records/s of CPU | {records / without:,.0f} | {records / with_:,.0f} "
        f"| {with_ / without - 1:.0%} |"
    )
    print(f"| ms a run | {1e3 * without / RUNS:.2f} | {1e3 * with_ / RUNS:.2f} | |")
    without, with_, _ = least(rehearsals_s)
    print(
        f"| ms a rehearsal | {1e3 * without / REHEARSALS:.2f} | {1e3 * with_ / REHEARSALS:.2f} "
        f"| {with_ / without - 1:.0%} |"
    )


if __name__ == "__main__":
    main()
