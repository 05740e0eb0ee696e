"""The order of tasks that wait: the net follows any, so that no deadlock of an executive is missed.

The allocator of the tests serves as an executive does: by priority, then who asked first.
"""

from collections.abc import Sequence
from random import Random

import pytest

from m2pem.engine import inputs as i
from m2pem.engine.state import RunStatus
from m2pem.fleet.default_fleet import fleet_for
from m2pem.verify.check import Report, check
from m2pem.verify.properties.results import Verdict
from m2pem.verify.translate import translate
from tests.engine.notation import mission as notation
from tests.verify.allocator import with_vehicles
from tests.verify.keeping_walk import KeepingWalk
from tests.verify.random_needs import AIR
from tests.verify.random_waiting import several
from tests.verify.test_keeping import WITHOUT_FAILURES, beside, subprocess
from tests.verify.test_roles_by_need import messages as messages_of
from tests.verify.test_roles_by_need import verdict
from tests.verify.test_shared_space import BRIDGE, WAITS, both, report_of, rovers
from tests.verify.trace_mapping import TooManyStatesError

ONE = tuple(
    f"need:{which};wait=unlimited;priority={priority}{keep}"
    for which in ("vehicle=uav1", "vehicle=uav2", f"requires={AIR}")
    for priority in (0, 1)
    for keep in ("", ";keep=subprocess", ";keep=process")
)
"""Roles of tasks that wait for one vehicle."""


TWO = (f"need:count=2;requires={AIR};wait=unlimited", *(e for e in ONE if "priority=0" in e))
"""Roles of tasks that wait for one vehicle, or for both."""


def waiting(dice: Random, roles: Sequence[str] = ONE, keeping: str = "PQR") -> str:
    """Two or three subprocesses in parallel, of tasks that wait for vehicles. `keeping`: those
    whose first task keeps one."""
    parts = []
    for name in ("P", "Q", "R")[: dice.randint(2, 3)]:
        first = [each for each in roles if each.endswith("subprocess")]
        tasks = [
            f'<scriptTask id="{name}{number}">do drive_stop {dice.choice(each)}</scriptTask>'
            for number, each in enumerate(
                (first if name in keeping else roles, *[roles] * dice.randint(1, 2))
            )
        ]
        parts.append(subprocess(name, *tasks))
    return beside(*parts)


class ClosedWalk(KeepingWalk):
    """Signals come from the mission alone, and no behavior fails."""

    def things(self) -> list[i.Input]:
        self.fails = False
        return [each for each in super().things() if not isinstance(each, i.SignalReceived)]


def stuck(text: str, seed: int, **vehicles: str) -> bool:
    """Whether tasks wait for ever in a run of the engine. Then they do in the net, too."""
    mission = notation(text)
    fleet = with_vehicles(fleet_for(mission), uav1="red", uav2="red", **vehicles)
    net = translate(mission, fleet, options=WITHOUT_FAILURES)
    walk = ClosedWalk(mission, fleet, net, seed)
    try:
        assert walk.go(60) == ""
    except TooManyStatesError:
        return False
    state = walk.run.state
    waits = state.status is RunStatus.RUNNING and not walk.things()
    if waits:
        assert state.allocations
        assert walk.follower.may_be_stuck
        report = check(mission, fleet, options=WITHOUT_FAILURES)
        assert verdict(report, "no-deadlock") is Verdict.VIOLATED
    return waits


def test_tasks_that_wait_for_ever_in_the_engine_are_a_deadlock_of_the_net() -> None:
    found = [stuck(waiting(Random(seed)), seed) for seed in range(40)]
    assert 3 < sum(found) < len(found)


def test_so_are_tasks_that_wait_for_both_vehicles() -> None:
    found = [stuck(waiting(Random(seed), TWO, keeping="P"), seed) for seed in range(30, 46)]
    assert 3 < sum(found) < len(found)


@pytest.mark.long
@pytest.mark.parametrize("part", range(5))
def test_so_are_those_of_many_missions(part: int) -> None:
    for seed in range(1_000 + part, 1_400, 5):
        stuck(waiting(Random(seed)), seed)
        stuck(waiting(Random(seed), TWO, keeping="P"), seed)
        stuck(several(Random(seed)), seed, uav3="blue")


def test_a_task_gets_what_one_of_greater_priority_that_lacks_space_could_have() -> None:
    """B waits for a place on the bridge, on which A stands; its vehicle is free for C."""
    stays = f"goto ugv1 target={BRIDGE}"
    text = both(
        stays, f"single_vehicle_routing {WAITS};priority=1 route=back", f"drive_stop {WAITS}"
    )
    (said,) = messages_of(text, report_of(text, rovers()), "no-deadlock")
    assert "B waits for bridge, where ugv1 is" in said
    assert "C waits" not in said


SEVERAL = """
<startEvent id="s"/><parallelGateway id="f"/><endEvent id="e"/>
<scriptTask id="H">do follow uav1 target=x</scriptTask>
<boundaryEvent id="h" attachedToRef="H">signal go</boundaryEvent>
<scriptTask id="Two">do drive_stop {two}</scriptTask>
<userTask id="ask">ask on</userTask>
<scriptTask id="Later">do drive_stop need:vehicle=uav2;wait=unlimited</scriptTask>
<intermediateThrowEvent id="t">signal go</intermediateThrowEvent>
s -> f
f -> H -> e
f -> Two -> e
f -> ask -> Later -> t -> e
h -> e
"""


def ends(text: str, **vehicles: str) -> Report:
    mission = notation(text)
    fleet = with_vehicles(fleet_for(mission), uav1="red", uav2="red", **vehicles)
    return check(mission, fleet, options=WITHOUT_FAILURES)


def test_a_wait_for_several_that_keeps_one_from_a_later_task_is_a_circle_that_is_found() -> None:
    text = SEVERAL.format(two=f"need:count=2;requires={AIR};wait=unlimited")
    mission = notation(text)
    fleet = with_vehicles(fleet_for(mission), uav1="red", uav2="red")
    walk = KeepingWalk(mission, fleet, translate(mission, fleet, options=WITHOUT_FAILURES), 0)
    assert walk.give(i.StartRun("MAIN"))
    (prompt,) = walk.run.state.prompts.values()
    walk.give(i.PromptAnswer(prompt.id, "on"))  # later: the other one has asked before
    asking = {each.token.node.id for each in walk.run.state.allocations.values()}
    assert asking == {"Two", "Later"}  # each waits for the other, through H
    report = ends(text)
    assert verdict(report, "can-complete") is Verdict.VIOLATED
    (message,) = messages_of(text, report, "can-complete")
    assert "Two waits for uav1 or uav2, uav1 is held by script task H" in message
    assert not report.net.approximations


WAITING = "do drive_stop need:wait=unlimited"
KEEPS = subprocess(
    "P",
    f'<scriptTask id="A">{WAITING};vehicle=uav1;keep=subprocess</scriptTask>',
    f'<scriptTask id="Later">{WAITING};vehicle=uav2</scriptTask>',
)
TWO_OF = f"need:count=2;requires={AIR}"


@pytest.mark.parametrize(
    ("two", "vehicles", "expected"),
    [
        (f"{TWO_OF};wait=unlimited", {}, Verdict.VIOLATED),
        (f"{TWO_OF};wait=unlimited;priority=1", {}, Verdict.HOLDS),  # it is served first
        (f"{TWO_OF};wait=PT3S", {}, Verdict.HOLDS),
        (f"{TWO_OF};wait=unlimited", {"uav3": "red", "uav4": "red"}, Verdict.HOLDS),
        (f"need:count=3;requires={AIR};wait=unlimited", {"uav3": "red"}, Verdict.VIOLATED),
        (
            "need:vehicle=uav1;wait=unlimited need:requires='blue'in[vehicle.tags[0]]",
            {"uav3": "blue"},
            Verdict.HOLDS,
        ),
    ],
)
def test_a_circle_is_found_where_there_is_one(
    two: str, vehicles: dict[str, str], expected: Verdict
) -> None:
    report = ends(
        beside(KEEPS, f'<scriptTask id="Two">do drive_stop {two}</scriptTask>'), **vehicles
    )
    assert verdict(report, "no-deadlock") is expected


@pytest.mark.parametrize(
    ("more", "expected"), [({}, Verdict.VIOLATED), ({"uav4": "red"}, Verdict.HOLDS)]
)
def test_three_tasks_of_several_that_each_keep_one_are_a_circle(
    more: dict[str, str], expected: Verdict
) -> None:
    parts = [
        subprocess(
            name,
            f'<scriptTask id="{name}1">{WAITING};vehicle=uav{n};keep=subprocess</scriptTask>',
            f'<scriptTask id="{name}2">do drive_stop {TWO_OF};wait=unlimited</scriptTask>',
        )
        for n, name in enumerate("PQR", 1)
    ]
    assert verdict(ends(beside(*parts), uav3="red", **more), "no-deadlock") is expected


def test_a_circle_through_what_two_tasks_of_several_keep_is_found() -> None:
    """Later waits for what Y keeps, that for what X keeps, and that for what P keeps."""
    pairs = {"X": "uav1 uav2", "Y": "uav2 uav3"}
    tasks = [
        f'<scriptTask id="{name}">do drive_stop '
        f"{' '.join(f'need:vehicle={each};wait=unlimited' for each in both.split())}</scriptTask>"
        for name, both in pairs.items()
    ]
    text = beside(KEEPS.replace("vehicle=uav2", "vehicle=uav3"), *tasks)
    report = ends(text, uav3="red")
    (message,) = messages_of(text, report, "no-deadlock")
    assert "Later waits for uav3, what is free is kept by script task Y until" in message
    assert "Y waits for uav2 or uav3, what is free is kept by script task X until" in message
    assert not report.net.approximations


def test_a_deadlock_names_the_task_that_keeps_what_is_free() -> None:
    text = beside(KEEPS, f'<scriptTask id="Two">do drive_stop {TWO_OF};wait=unlimited</scriptTask>')
    (message,) = messages_of(text, ends(text), "no-deadlock")
    assert "Two waits for uav1 or uav2, uav1 is kept by script task A until" in message
    assert "waits for uav2, what is free is kept by script task Two until it has the" in message


def test_a_later_task_of_a_greater_priority_is_kept_from_nothing() -> None:
    text = SEVERAL.format(two=f"{TWO_OF};wait=unlimited")
    text = text.replace("vehicle=uav2;wait=unlimited", "vehicle=uav2;wait=unlimited;priority=1")
    assert verdict(ends(text), "can-complete") is Verdict.HOLDS


def test_one_vehicle_after_the_other_with_keep_is_a_circle_that_is_found() -> None:
    first = "need:vehicle=uav2;wait=unlimited;keep=subprocess"
    then = "need:vehicle=uav1;wait=unlimited"
    text = SEVERAL.format(two="uav9").replace(
        '<scriptTask id="Two">do drive_stop uav9</scriptTask>',
        subprocess(
            "Two",
            f'<scriptTask id="A">do drive_stop {first}</scriptTask>',
            f'<scriptTask id="B">do drive_stop {then}</scriptTask>',
        ),
    )
    mission = notation(text)
    fleet = with_vehicles(fleet_for(mission), uav1="red", uav2="red")
    report = check(mission, fleet, options=WITHOUT_FAILURES)
    assert verdict(report, "can-complete") is Verdict.VIOLATED
    (message,) = messages_of(text, report, "can-complete")
    assert message.endswith(
        "; script task Later waits for uav2, "
        "uav2 is held by script task A and kept until subprocess Two ends"
    )
