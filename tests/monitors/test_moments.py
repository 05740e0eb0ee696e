"""The moments that monitors see are those of the checker."""

from pathlib import Path
from random import Random

import pytest

from m2pem.bpmn import read_mission
from m2pem.engine.inputs import Input
from m2pem.engine.records import RunEnded
from m2pem.engine.run import Step
from m2pem.errors import MissionError
from m2pem.fleet.default_fleet import fleet_for
from m2pem.mission import elements as e
from m2pem.mission import events
from m2pem.mission.mission import Mission
from m2pem.monitors.moments import Moments
from m2pem.verify.ltl import parse, propositions
from m2pem.verify.ltl.formula import OUTCOMES, Active, Commanded, Completed, Ended, Proposition
from m2pem.verify.net.petri_net import Exactness, PetriNet
from m2pem.verify.translate import Options, translate
from tests.engine.notation import mission as notation
from tests.engine.random_missions import graph, structured
from tests.monitors.net_runs import NetRuns
from tests.verify.models import Walk
from tests.verify.trace_mapping import TooManyStatesError

ROOT = Path(__file__).parents[2]
OPEN = Options(open_world=True, service_writes={"Detector": ["detection.type"]})
FILES = sorted(
    [
        *ROOT.glob("missions/*.bpmn"),
        *ROOT.glob("examples/*/mission.bpmn"),
        *ROOT.glob("tests/data/*/*.bpmn"),
    ]
)
APART = {
    "message_boundary_call": "a subprocess that is interrupted loses its tokens a step later",
    "message_boundary_subprocess": "the same",
    "inclusive_merge_and_split": "tokens leave a join, and then no flow is true",
}
"""Files whose net takes other steps than the engine, and why."""
PARTS = 4

_APART = (
    events.ConditionalEventDefinition,
    events.SignalEventDefinition,
    events.EscalationEventDefinition,
    events.CompensateEventDefinition,
    events.TerminateEventDefinition,
    events.CancelEventDefinition,
)


def is_step_by_step(mission: Mission) -> bool:
    """Whether each step of the engine is one of the net (docs/requirements.md, "In runs")."""
    for node in mission.nodes:
        if isinstance(node, e.Event) and any(isinstance(d, _APART) for d in node.definitions):
            return False
        if isinstance(node, e.EventBasedGateway | e.ComplexGateway | e.AdHocSubProcess):
            return False
        if isinstance(node, e.Activity) and (
            node.loop is not None or node.start_quantity > 1 or isinstance(node, e.Transaction)
        ):
            return False
    return True


def all_propositions(mission: Mission, net: PetriNet) -> list[Proposition]:
    """All but those of start events: in a subprocess they are only passed."""
    named = [node.id for node in mission.nodes if not isinstance(node, e.StartEvent)]
    named.append(net.process)
    return [
        *map(Active, named),
        *map(Completed, named),
        *map(Commanded, fleet_for(mission).vehicles),
        *map(Ended, OUTCOMES),
    ]


def first_unlike(mission: Mission, seeds: range) -> str | None:
    """What a run of the engine does that no run of the net does; "" if there is nothing.

    None: the states of the net could not be followed in any run, as they are too many.
    """
    net, fleet = translate(mission, options=OPEN), fleet_for(mission)
    if any(each.exactness is Exactness.BOUNDED for each in net.approximations):
        return ""
    known = all_propositions(mission, net)
    followed = 0
    for seed in seeds:
        try:
            walk, runs = Walk(mission, fleet, net, seed), NetRuns(net, mission, fleet, known)
        except TooManyStatesError:
            continue
        given: list[int] = []
        moments = Moments(known, mission, fleet, lambda letter, _: given.append(letter))  # noqa: B023
        receive = walk.run.receive
        unlike: list[str] = []

        def observed(item: Input, now_us: int) -> Step:
            step = receive(item, now_us)  # noqa: B023
            ended = step.records[-1]
            stuck = isinstance(ended, RunEnded) and ended.detail.startswith("stuck")
            moments.read(step.records)  # noqa: B023
            if stuck:
                given.pop()  # noqa: B023  # a deadlock is no end of the net
            for letter in given:  # noqa: B023
                if not unlike and not runs.accept(letter):  # noqa: B023
                    true = [each for n, each in enumerate(known) if letter >> n & 1]
                    unlike.append(f"seed {seed}, after {item}: {true}")  # noqa: B023
            given.clear()  # noqa: B023
            return step

        walk.run.receive = observed  # type: ignore[method-assign]  # it is followed as it goes
        try:
            lost = walk.go()
        except TooManyStatesError:
            continue
        followed += 1
        if not lost and unlike:
            return unlike[0]
    return "" if followed else None


@pytest.mark.parametrize("part", range(PARTS))
def test_each_moment_of_a_run_is_one_of_a_run_of_the_net(part: int) -> None:
    wrong, compared = {}, 0
    for file in FILES[part::PARTS]:
        try:
            mission = read_mission(file)
        except MissionError:
            continue
        if file.stem not in APART and is_step_by_step(mission):
            compared += 1
            if found := first_unlike(mission, range(2)):
                wrong[file.name] = found
    assert wrong == {}
    assert compared > 40


@pytest.mark.parametrize(
    "text",
    [
        """<startEvent id="start"/>
        start -> wait
        <intermediateCatchEvent id="wait">timer PT5S</intermediateCatchEvent>""",
        """<startEvent id="start"/>
        start -> wait
        <intermediateCatchEvent id="wait">message M</intermediateCatchEvent>""",
        """<startEvent id="start"/>
        start -> busy
        start -> done
        start -> fails
        <scriptTask id="busy">do drive_stop uav1</scriptTask> <exclusiveGateway id="done"/>
        <scriptTask id="fails">do drive_stop uav1</scriptTask>""",
    ],
    ids=["nothing follows a timer", "nothing follows a message", "a task fails after a completion"],
)
def test_it_is_so_of(text: str) -> None:
    assert first_unlike(notation(text), range(3)) == ""


@pytest.mark.parametrize(
    ("first", "last"), [(0, 60), pytest.param(60, 1_000, marks=pytest.mark.long)]
)
def test_it_is_so_of_random_missions(first: int, last: int) -> None:
    wrong, compared, passed_over = {}, 0, 0
    for seed in range(first, last):
        mission = notation((structured if seed % 2 else graph)(Random(seed)))
        if not is_step_by_step(mission):
            continue
        found = first_unlike(mission, range(3))
        compared += found is not None
        passed_over += found is None
        if found:
            wrong[seed] = found
    assert wrong == {}
    assert passed_over * 10 <= compared


def letters(mission: Mission, formula: str, seed: int) -> list[frozenset[str]]:
    """The moments of a run, by what is true in each of a formula's propositions."""
    fleet = fleet_for(mission)
    walk = Walk(mission, fleet, translate(mission, options=OPEN), seed)
    known = propositions(parse(formula))
    given: list[int] = []
    moments = Moments(known, mission, fleet, lambda letter, _: given.append(letter))
    receive = walk.run.receive

    def observed(item: Input, now_us: int) -> Step:
        step = receive(item, now_us)
        moments.read(step.records)
        return step

    walk.run.receive = observed  # type: ignore[method-assign]  # it is followed as it goes
    walk.go()
    return [
        frozenset(type(each).__name__ for n, each in enumerate(known) if letter >> n & 1)
        for letter in given
    ]


def test_a_completion_is_true_for_one_moment_and_a_quiet_one_follows() -> None:
    mission = read_mission(ROOT / "missions" / "survey_pair.bpmn")
    given = letters(mission, "active(SurveyWest) && completed(TakeoffUav1)", 1)
    at = given.index(frozenset({"Active", "Completed"}))
    assert given[at - 1] == frozenset()
    assert given[at + 1] == frozenset({"Active"})
