"""The order of tasks that wait: the net follows any, so that no deadlock of an executive is missed.

The allocator of the tests serves as an executive does: by priority, then who asked first.
"""

from random import Random

import pytest

from m2pem.engine import inputs as i
from m2pem.engine.state import RunStatus
from m2pem.fleet.default_fleet import fleet_for
from m2pem.verify.check import check
from m2pem.verify.net.petri_net import Exactness
from m2pem.verify.properties.results import Verdict
from m2pem.verify.translate import translate
from tests.engine.notation import mission as notation
from tests.verify.allocator import with_vehicles
from tests.verify.keeping_walk import KeepingWalk
from tests.verify.random_needs import AIR
from tests.verify.test_keeping import WITHOUT_FAILURES, beside, subprocess
from tests.verify.test_roles_by_need import messages as messages_of
from tests.verify.test_roles_by_need import verdict
from tests.verify.test_shared_space import BRIDGE, WAITS, both, report_of, rovers

ONE = tuple(
    f"need:{which};wait=unlimited;priority={priority}{keep}"
    for which in ("vehicle=uav1", "vehicle=uav2", f"requires={AIR}")
    for priority in (0, 1)
    for keep in ("", ";keep=subprocess", ";keep=process")
)
"""Roles of tasks that wait for one vehicle."""


def waiting(dice: Random) -> str:
    """Two or three subprocesses in parallel, of tasks that wait for one vehicle each."""
    parts = []
    for name in ("P", "Q", "R")[: dice.randint(2, 3)]:
        first = [each for each in ONE if each.endswith("subprocess")]
        tasks = [
            f'<scriptTask id="{name}{number}">do drive_stop {dice.choice(roles)}</scriptTask>'
            for number, roles in enumerate((first, *[ONE] * dice.randint(1, 2)))
        ]
        parts.append(subprocess(name, *tasks))
    return beside(*parts)


def stuck(text: str, seed: int) -> bool:
    """Whether tasks wait for ever in a run of the engine. Then they do in the net, too."""
    mission = notation(text)
    fleet = with_vehicles(fleet_for(mission), uav1="red", uav2="red")
    walk = KeepingWalk(mission, fleet, translate(mission, fleet, options=WITHOUT_FAILURES), seed)
    walk.fails = False
    assert walk.go(60) == ""
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


@pytest.mark.long
@pytest.mark.parametrize("part", range(5))
def test_so_are_those_of_many_missions(part: int) -> None:
    for seed in range(1_000 + part, 1_400, 5):
        stuck(waiting(Random(seed)), seed)


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


def test_a_wait_for_several_that_keeps_one_from_a_later_task_is_said_not_to_be_followed() -> None:
    text = SEVERAL.format(two=f"need:count=2;requires={AIR};wait=unlimited")
    mission = notation(text)
    fleet = with_vehicles(fleet_for(mission), uav1="red", uav2="red")
    walk = KeepingWalk(mission, fleet, translate(mission, fleet, options=WITHOUT_FAILURES), 0)
    assert walk.give(i.StartRun("MAIN"))
    (prompt,) = walk.run.state.prompts.values()
    walk.give(i.PromptAnswer(prompt.id, "on"))  # later: the other one has asked before
    asking = {each.token.node.id for each in walk.run.state.allocations.values()}
    assert asking == {"Two", "Later"}  # each waits for the other, through H
    report = check(mission, fleet, options=WITHOUT_FAILURES)
    assert verdict(report, "can-complete") is Verdict.HOLDS
    (rough,) = [each for each in report.net.approximations if "waits for the rest" in each.what]
    assert (rough.element, rough.exactness) == ("Two", Exactness.BOUNDED)


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
