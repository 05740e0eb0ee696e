"""What monitors of requirements cost: CPU time with 0 and 20 of them.

`python -m bench.monitors` prints a table: of the bare engine, which forgets its records; of the
engine with a journal on disk, which has each step before the next one, as in runs; and of whole
rehearsals, in which the executive commands simulated vehicles. The short run is of
`missions/survey_pair.bpmn`; its 20 requirements are those of docs/requirements.md and more of
their kind. The long run is a patrol of 1,000 rounds, whose 20 requirements stay open; each moment
of it changes what some are about.
Rounds with and without take turns, and the least time of each counts.
"""

import asyncio
import re
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from xml.sax.saxutils import quoteattr

from bench.play_m2pem import entry
from m2pem.bpmn import parse_mission, read_mission
from m2pem.engine.inputs import BehaviorReported, Input, MonitoredRequirement, StartRun
from m2pem.engine.run import MissionRun
from m2pem.engine.state import RunStatus
from m2pem.fleet.fleet_file import load_fleet
from m2pem.journal import RunHeader
from m2pem.journal.sqlite import SqliteJournal
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.mission import Mission
from m2pem.monitors.run_monitors import RunMonitors
from m2pem.monitors.selection import monitored
from m2pem.plugins import PluginManager
from m2pem.rehearsal.rehearsal import Rehearser
from m2pem.verify.requirements import Names, parse_spec

ROOT = Path(__file__).parents[1]
MISSION = read_mission(ROOT / "missions" / "survey_pair.bpmn")
FLEET = load_fleet(ROOT / "fleet_configs" / "survey_pair.yaml")
START_US = 1_767_225_600_000_000
RUNS, ROUNDS, REHEARSALS = 200, 7, 20
PLUGINS = PluginManager()
Given = list[tuple[int, Input]]
_VEHICLES = ("uav1", "uav2", "rover1")

_PAIRS = [(v, w) for v in _VEHICLES for w in _VEHICLES if v != w]
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


_PATROL = f"""<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
  xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="bench"><process id="PATROL"
  isExecutable="true"><startEvent id="Start"/><exclusiveGateway id="Again"/>
  <scriptTask id="Count"><script>n = n + 1</script></scriptTask>
  {
    "".join(
        f'<scriptTask id="Go{n}"><extensionElements><m2pem:behavior type="vehicle" name="goto">'
        '<m2pem:properties><m2pem:property name="target" value="gate"/></m2pem:properties>'
        f'<m2pem:resources><m2pem:role name="driver" vehicle="{vehicle}"/></m2pem:resources>'
        "</m2pem:behavior></extensionElements></scriptTask>"
        for n, vehicle in enumerate(_VEHICLES)
    )
}
  <exclusiveGateway id="More" default="Out"/><endEvent id="End"/>
  <sequenceFlow id="F1" sourceRef="Start" targetRef="Again"/>
  <sequenceFlow id="F2" sourceRef="Again" targetRef="Count"/>
  <sequenceFlow id="F3" sourceRef="Count" targetRef="Go0"/>
  <sequenceFlow id="F4" sourceRef="Go0" targetRef="Go1"/>
  <sequenceFlow id="F5" sourceRef="Go1" targetRef="Go2"/>
  <sequenceFlow id="F6" sourceRef="Go2" targetRef="More"/>
  <sequenceFlow id="F7" sourceRef="More" targetRef="Again">
    <conditionExpression>n &lt; 1000</conditionExpression></sequenceFlow>
  <sequenceFlow id="Out" sourceRef="More" targetRef="End"/></process></definitions>""".encode()
_OF_PATROL = (
    *(f"[](active(Go{n}) -> <> completed(Go{n}))" for n in range(3)),
    *(f"[](commanded({v}) -> !commanded({w}))" for v, w in _PAIRS),
    *(f"[](completed(Go{n}) -> once(completed(Count)))" for n in range(3)),
    *(f"[]<> active(Go{n}) || <> ended" for n in range(3)),
    "[] !(active(Go0) && active(Go1))",
    "[] !(active(Go1) && active(Go2))",
    "[] !ended(failed)",
    "<> ended(completed)",
    "!active(Go2) W ended || <> ended",
)


def requirements() -> tuple[MonitoredRequirement, ...]:
    """The 20 requirements of the short run."""
    return of(_FORMULAS, MISSION)


def of(formulas: Sequence[str], mission: Mission) -> tuple[MonitoredRequirement, ...]:
    """Requirements of a mission."""
    entries = ", ".join(f'{{id: r{n}, ltl: "{each}"}}' for n, each in enumerate(formulas))
    spec = f"requirements: [{entries}]".encode()
    return monitored(parse_spec(spec, "bench.yaml", Names(mission, FLEET)))


def inputs(mission: Mission, required: tuple[MonitoredRequirement, ...]) -> Given:
    """The inputs of a run in which every behavior succeeds, and their times."""
    run = MissionRun(mission, FLEET, "r1")
    now_us = START_US
    item: Input = StartRun(mission.process().id, {"n": 0}, requirements=required)
    found = []
    while True:
        found.append((now_us, item))
        run.receive(item, now_us)
        if run.state.status is RunStatus.ENDED:
            return found
        now_us += 10_000_000
        behavior = next(iter(run.state.behaviors.values()))
        item = BehaviorReported(behavior.id, 1, BehaviorState.SUCCEEDED)


def engine_s(mission: Mission, given: Given, runs: int) -> tuple[float, int]:
    """CPU seconds of the engine, and the number of records, of some runs."""
    records = 0
    begun_s = time.process_time()
    for _ in range(runs):
        run = MissionRun(mission, FLEET, "r1")
        monitors = RunMonitors(run.state, FLEET)
        for at_us, item in given:
            step = run.receive(item, at_us)
            records += len(step.records)
            monitors.observe(step.t_us, step.records)
            for verdict in monitors.take():
                decided = run.receive(verdict, at_us)
                monitors.observe(decided.t_us, decided.records)
    return time.process_time() - begun_s, records


def journaled_s(mission: Mission, given: Given) -> tuple[float, int]:
    """CPU seconds of the engine and its journal on disk, and the number of records."""
    return asyncio.run(_journaled_s(mission, given))


async def _journaled_s(mission: Mission, given: Given) -> tuple[float, int]:
    with tempfile.TemporaryDirectory(dir=Path.cwd()) as scratch:
        journal = SqliteJournal.open(Path(scratch, "journal.db"))
        name = await journal.create(RunHeader("bench.bpmn", mission.source, mission.process().id))
        records, begun_s = 0, time.process_time()
        run = MissionRun(mission, FLEET, name)
        monitors = RunMonitors(run.state, FLEET)
        for at_us, item in given:
            steps = [run.receive(item, at_us)]
            monitors.observe(steps[0].t_us, steps[0].records)
            for verdict in monitors.take():
                steps.append(run.receive(verdict, at_us))
                monitors.observe(steps[-1].t_us, steps[-1].records)
            await journal.append([entry(name, each) for each in steps])
            records += sum(len(each.records) for each in steps)
        took_s = time.process_time() - begun_s
        await journal.release(name)
        await journal.close()
    return took_s, records


def rehearsals_s(
    mission: Mission, required: tuple[MonitoredRequirement, ...], times: int
) -> tuple[float, int]:
    """CPU seconds of rehearsals, and the number of their records."""
    rehearser = Rehearser(
        parse_mission(with_requirements(mission, required), mission.file), FLEET, PLUGINS
    )
    rehearser.rehearse(data={"n": 0})  # reads the requirements, once for all
    records = 0
    begun_s = time.process_time()
    for _ in range(times):
        records += len(rehearser.rehearse(data={"n": 0}).records)
    return time.process_time() - begun_s, records


def with_requirements(mission: Mission, required: tuple[MonitoredRequirement, ...]) -> bytes:
    """The mission's file with requirements in it."""
    inside = "".join(
        f"<m2pem:requirement id={quoteattr(each.id)} ltl={quoteattr(each.formula)}/>"
        for each in required
    )
    added = rf"<\1extensionElements>{inside}</\1extensionElements>\g<0>".encode()
    return re.sub(rb"<(bpmn:|)startEvent ", added, mission.source, count=1)


def least(
    required: tuple[MonitoredRequirement, ...],
    measure: Callable[[tuple[MonitoredRequirement, ...]], tuple[float, int]],
) -> tuple[float, float, int]:
    """The least time without and with monitors, and the records without."""
    without, with_, records = [], [], 0
    for _ in range(ROUNDS):
        seconds, records = measure(())
        without.append(seconds)
        with_.append(measure(required)[0])
    return min(without), min(with_), records


def row(name: str, times: int, took: tuple[float, float, int]) -> None:
    """Print what monitors cost. `took`: seconds without and with them, and records."""
    without, with_, records = took
    print(
        f"| {name}, {records // times:,} records | {1e3 * without / times:.2f} "
        f"| {1e3 * with_ / times:.2f} | {with_ / without - 1:.0%} |"
    )


def rows(name: str, mission: Mission, formulas: Sequence[str], runs: int, rehearsals: int) -> None:
    """Print what monitors cost in runs of a mission."""
    required = of(formulas, mission)
    given = {each: inputs(mission, each) for each in ((), required)}
    took = least(required, lambda each: engine_s(mission, given[each], runs))
    row(f"{name}: engine", runs, took)
    took = least(required, lambda each: journaled_s(mission, given[each]))
    row(f"{name}: engine and journal", 1, took)
    took = least(required, lambda each: rehearsals_s(mission, each, rehearsals))
    row(f"{name}: rehearsal", rehearsals, took)


def main() -> None:
    """Print the table."""
    print("| ms | 0 monitors | 20 monitors | more |")
    print("|---|---|---|---|")
    rows("short run", MISSION, _FORMULAS, RUNS, REHEARSALS)
    rows("long run", parse_mission(_PATROL, "patrol.bpmn"), _OF_PATROL, 1, 1)


if __name__ == "__main__":
    main()
