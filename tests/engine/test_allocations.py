"""Tasks whose resources are chosen when they start: the engine's part (docs/allocation.md)."""

from dataclasses import replace

import pytest

from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.engine.commands import AllocateResources, StartBehavior, WithdrawAllocation
from m2pem.fleet.fleet import Domain, Fleet, OnConflict, SharedSpace, Vehicle
from m2pem.mission.catalogue import ResourceId
from tests.engine.kit import CANCELLED, Play

NAMES = ("ugv1", "ugv2")
FLEET = Fleet(
    "test",
    "test",
    {ResourceId(name): Vehicle(ResourceId(name), Domain.GROUND, "sim", {}) for name in NAMES},
)


def task(name: str, role: str) -> str:
    return (
        f'<scriptTask id="{name}"><extensionElements><m2pem:behavior type="vehicle" '
        f'name="drive_stop"><m2pem:resources><m2pem:role name="driver" {role}/>'
        "</m2pem:resources></m2pem:behavior></extensionElements></scriptTask>"
    )


def play(role: str, rest: str = "") -> Play:
    """A task with a role by need between a start and a user task."""
    return Play(
        f"""<startEvent id="start"/> {task("go", role)} <userTask id="then"/> {rest}
        start -> go -> then
        """,
        fleet=FLEET,
    ).start()


def choose(world: Play, *resources: str, allocation: str = "r1.a1") -> Play:
    return world.give(i.ResourcesChosen(allocation, {"driver": resources}, {"why": "a test"}))


def commands(world: Play) -> list[object]:
    return [command for step in world.steps for command in step.commands]


def test_the_task_asks_and_its_behavior_follows_the_choice() -> None:
    world = play('requires="true" store="who"')
    assert commands(world) == [AllocateResources("r1.a1")]
    choose(world, "ugv2")
    kinds = [type(record).__name__ for record in world.steps[-1].records]
    assert kinds == ["ResourcesAllocated", "DataWritten", "BehaviorRequested"]
    assert world.run.state.root.data == {"who": "ugv2"}  # type: ignore[union-attr]
    assert isinstance(commands(world)[-1], StartBehavior)
    world.report("go")
    assert world.at == "then"


def test_a_choice_that_was_taken_meanwhile_is_made_again() -> None:
    world = play('requires="true"')
    world.give(i.ControlTaken("ugv1", "ops"))
    choose(world, "ugv1")
    (delayed,) = world.steps[-1].records
    assert delayed == r.AllocationDelayed("r1.a1", "ugv1 is with ops", {}, again=True)
    assert world.steps[-1].commands == [AllocateResources("r1.a1", again=True)]
    choose(world, "ugv2").report("go")
    assert world.at == "then"


def test_a_reason_is_journaled_once() -> None:
    world = play('requires="true" wait="unlimited"')
    for _ in range(2):
        world.give(i.ResourcesNotFree("r1.a1", "ugv1 is held by r2.b1", {"ugv1": "r2.b1"}))
    delayed = [each for each in world.records() if isinstance(each, r.AllocationDelayed)]
    assert len(delayed) == 1
    assert isinstance(world.steps[-1].records[0], r.InputIgnored)


def test_an_event_that_ends_the_task_ends_its_request() -> None:
    world = play(
        'requires="true" wait="unlimited"',
        '<boundaryEvent id="late" attachedToRef="go">timer PT5S</boundaryEvent>\nlate -> then',
    )
    world.advance(5)
    assert world.at == "then"
    assert WithdrawAllocation("r1.a1") in commands(world)
    choose(world, "ugv1")
    (ignored,) = world.steps[-1].records
    assert ignored == r.InputIgnored("request r1.a1 has ended")
    assert not world.run.state.allocations


def test_the_limit_of_a_wait_does_not_end_the_behavior_that_was_begun_in_time() -> None:
    world = play('requires="true" wait="PT10S"')
    world.advance(9)
    choose(world, "ugv1")
    world.advance(60)
    assert world.at == "go"
    assert not world.run.state.waits
    world.report("go")
    assert world.at == "then"


def test_a_limit_that_has_passed_is_an_error_that_an_event_catches() -> None:
    world = play(
        'requires="true" wait="PT10S"',
        '<boundaryEvent id="none" attachedToRef="go">error RESOURCE_UNAVAILABLE</boundaryEvent>'
        "\nnone -> then",
    )
    world.give(i.ResourcesNotFree("r1.a1", "ugv1 is held by r2.b1"))
    world.advance(10)
    assert world.at == "then"
    error = next(each for each in world.records() if isinstance(each, r.ErrorThrown))
    assert error.reason.endswith("ugv1 is held by r2.b1")


def test_a_wait_stops_with_the_mission_time_of_a_pause() -> None:
    world = play('requires="true" wait="PT10S"')
    world.advance(5)
    world.pause()
    world.advance(60)
    world.resume()
    world.advance(4)
    assert world.at == "go"
    choose(world, "ugv1").report("go")
    assert world.at == "then"


def test_a_choice_during_a_pause_counts_when_the_run_goes_on() -> None:
    world = play('requires="true"')
    world.pause()
    choose(world, "ugv1")
    assert not world.run.state.behaviors
    world.resume()
    assert world.run.state.behaviors["r1.b1"].resources == ("ugv1",)


def test_what_the_run_has_cancelled_itself_is_preempted() -> None:
    world = play(
        'requires="true"',
        f"""{task("again", 'requires="true"')}
        <boundaryEvent id="late" attachedToRef="go">timer PT5S</boundaryEvent>
        late -> again
        """,
    )
    choose(world, "ugv1").advance(5)
    choose(world, "ugv1", allocation="r1.a2")
    assert world.run.state.behaviors["r1.b2"].preempts == ("r1.b1",)
    world.report("b1", CANCELLED).report("again")
    assert not world.run.state.held


def test_requests_are_outstanding_after_a_restart() -> None:
    world = play('requires="true" wait="unlimited"')
    assert AllocateResources("r1.a1") in world.run.outstanding()
    world.stop()
    assert not world.run.outstanding()


SHARED = replace(
    FLEET,
    shared_space={"bridge": SharedSpace("bridge", 1)},
)
FULL = "ugv1 would enter bridge (capacity 1), which is taken by ugv2"


def cross(name: str = "goto", role: str = "vehicle='ugv1'", fleet: Fleet = SHARED) -> Play:
    """A task that names its vehicle, in a fleet whose vehicles share space."""
    return Play(
        f"""<startEvent id="start"/>
        {task("go", role).replace("drive_stop", name)} <userTask id="then"/>
        start -> go -> then
        """,
        fleet=fleet,
    ).start()


def test_a_task_that_may_wait_for_space_asks_before_its_behavior_is_requested() -> None:
    world = cross()
    assert commands(world) == [AllocateResources("r1.a1")]
    choose(world, "ugv1")
    assert isinstance(commands(world)[-1], StartBehavior)


@pytest.mark.parametrize("name", ["hold", "drive_stop", "teleop"])
def test_a_task_that_stops_its_vehicle_never_waits_for_space(name: str) -> None:
    assert isinstance(commands(cross(name))[0], StartBehavior)


def test_a_task_waits_for_no_space_in_a_fleet_that_refuses() -> None:
    refusing = SharedSpace("bridge", 1, on_conflict=OnConflict.REFUSE)
    world = cross(fleet=replace(FLEET, shared_space={"bridge": refusing}))
    assert isinstance(commands(world)[0], StartBehavior)


def test_a_wait_for_space_is_limited_from_when_it_begins() -> None:
    world = cross()
    full = i.ResourcesNotFree("r1.a1", FULL, {"bridge": "r2.b1"}, wait_s=30.0)
    world.give(full)
    delayed = world.steps[-1].records[-1]
    assert isinstance(delayed, r.AllocationDelayed)
    assert delayed.deadline == world.run.state.allocations["r1.a1"].deadline > 0
    # The limit is that of what it waits for first.
    world.give(i.ResourcesNotFree("r1.a1", "another reason", {"ford": "r3.b1"}, wait_s=90.0))
    assert world.run.state.allocations["r1.a1"].deadline == delayed.deadline
    world.advance(30)
    thrown = next(each for each in world.records() if isinstance(each, r.ErrorThrown))
    assert (thrown.code, "another reason" in thrown.reason) == ("RESOURCE_UNAVAILABLE", True)


def test_the_roles_say_how_long_a_task_waits_if_they_do() -> None:
    world = cross(role="vehicle='ugv1' wait='unlimited'")
    world.give(i.ResourcesNotFree("r1.a1", FULL, {"bridge": "r2.b1"}, wait_s=30.0))
    assert world.run.state.allocations["r1.a1"].deadline == 0


def test_a_task_that_does_not_wait_for_space_is_rejected() -> None:
    world = cross()
    world.give(i.ResourcesNotFree("r1.a1", FULL, {"bridge": "r2.b1"}, "REJECTED"))
    thrown = next(each for each in world.records() if isinstance(each, r.ErrorThrown))
    assert (thrown.code, thrown.reason) == ("REJECTED", FULL)
