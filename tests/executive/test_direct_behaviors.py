"""Behaviors that are commanded from outside of a mission."""

import asyncio

import pytest

from m2pem.api.runs import RunStatus
from m2pem.errors import BusyError, MissionError, OperatorError
from m2pem.mission.catalogue import BehaviorState
from m2pem.testing.fake_arbiter import Call
from tests.executive.conftest import World, behavior, mission, sequence

DRIVE = mission(sequence(("T", behavior("T", "drive_stop", "ugv1"))))
PLACE = {
    "type": "Feature",
    "properties": {},
    "geometry": {"type": "Point", "coordinates": [-77.0, 38.0]},
}


def test_it_is_a_run_that_ends_as_the_behavior_does(play):
    async def story(world: World):
        control = world.executive.control
        run = await control.execute_behavior(
            "ugv1", "goto", {"target": [38.0, -77.0], "speed": "2 m/s"}, by="anna"
        )
        await world.fake.until_called("start", f"{run}.b1")
        holders = await control.holders()
        world.fake.report(f"{run}.b1", BehaviorState.SUCCEEDED)
        request = world.fake.requests[f"{run}.b1"]
        return run, holders, request, await control.wait(run)

    run, holders, request, summary = play(story, "ugv1")
    assert holders == {"ugv1": f"{run}.b1"}
    assert request.behavior == "goto"
    assert request.parameters["speed"] == 2.0
    assert request.parameters["target"].position == (38.0, -77.0, None)
    assert summary.status is RunStatus.COMPLETED
    assert summary.mission == "goto of ugv1"


def test_a_geometry_is_taken_as_geojson_and_no_text_is_read_as_an_expression(play):
    async def story(world: World):
        control = world.executive.control
        run = await control.execute_behavior("ugv1", "goto", {"target": PLACE}, by="anna")
        await world.fake.until_called("start", f"{run}.b1")
        world.fake.report(f"{run}.b1", BehaviorState.SUCCEEDED)
        await control.wait(run)
        nested = {**PLACE, "properties": {"altitude_frame": "${1 + 1}"}}
        with pytest.raises(MissionError, match=r"altitude_frame .* is not known"):
            await control.execute_behavior("ugv1", "goto", {"target": nested}, by="anna")
        odd = await control.execute_behavior("ugv1", "goto", {"target": "${1 + 1}"}, by="anna")
        return world.fake.requests[f"{run}.b1"], await control.wait(odd)

    request, odd = play(story, "ugv1")
    assert request.parameters["target"].position[:2] == (38.0, -77.0)
    assert odd.status is RunStatus.FAILED
    assert "${1 + 1}" in odd.detail


@pytest.mark.parametrize(
    ("resource", "name", "parameters", "error", "says"),
    [
        ("ugv", "goto", {}, OperatorError, "did you mean 'ugv1'"),
        ("ugv1", "go_to", {}, MissionError, "did you mean 'goto'"),
        ("ugv1", "goto", {}, MissionError, "target"),
        ("ugv1", "goto", {"target": [38, -77], "speed": "9 kg"}, MissionError, "speed"),
        ("ugv1", "goto", {"target\x00": 1}, OperatorError, "goto of ugv1"),
    ],
)
def test_what_cannot_be_commanded_is_refused_and_moves_nothing(
    play, resource, name, parameters, error, says
):
    async def story(world: World):
        with pytest.raises(error, match=says):
            await world.executive.control.execute_behavior(resource, name, parameters, by="anna")
        return world.fake.calls, await world.executive.control.runs()

    assert play(story, "ugv1") == ([], [])


def test_what_a_mission_has_is_refused_until_it_is_taken_from_it(play):
    async def story(world: World):
        control = world.executive.control
        await control.start(DRIVE)
        await world.fake.until_called("start", "r1.b1")
        with pytest.raises(BusyError, match="run r1 uses ugv1"):
            await control.execute_behavior("ugv1", "drive_stop", by="anna")
        await control.take("ugv1", by="anna")
        asked = asyncio.create_task(control.execute_behavior("ugv1", "drive_stop", by="anna"))
        await world.fake.until_called("cancel", "r1.b1")
        assert not asked.done()
        world.fake.report("r1.b1", BehaviorState.CANCELLED)
        run = await asked
        await world.fake.until_called("start", f"{run}.b1")
        with pytest.raises(BusyError, match="anna has ugv1"):
            await control.execute_behavior("ugv1", "drive_stop", by="ben")
        world.fake.report(f"{run}.b1", BehaviorState.SUCCEEDED)
        done = await control.wait(run)
        return done, await control.holders()

    done, holders = play(story, "ugv1")
    assert done.status is RunStatus.COMPLETED
    assert holders == {"ugv1": "anna"}


def test_a_mission_does_not_get_what_an_operator_commands_by_a_behavior(play):
    async def story(world: World):
        control = world.executive.control
        await control.take("ugv1", by="anna")
        run = await control.execute_behavior("ugv1", "drive_stop", by="anna")
        await world.fake.until_called("start", f"{run}.b1")
        refused = await control.wait(await control.start(DRIVE, even_if_busy=True))
        world.fake.report(f"{run}.b1", BehaviorState.SUCCEEDED)
        await control.wait(run)
        again = await control.wait(await control.start(DRIVE, even_if_busy=True))
        return refused, again

    refused, again = play(story, "ugv1")
    assert "ugv1 is with anna" in refused.detail
    assert "ugv1 is with anna" in again.detail


def test_a_later_request_of_the_same_operator_replaces_the_one_before(play):
    async def story(world: World):
        control = world.executive.control
        first = await control.execute_behavior("ugv1", "goto", {"target": [38, -77]}, by="anna")
        await world.fake.until_called("start", f"{first}.b1")
        with pytest.raises(BusyError, match="does for anna"):
            await control.execute_behavior("ugv1", "drive_stop", by="ben")
        places = [[38, -77.1], [38, -77.2]]
        second, third = (
            asyncio.create_task(
                control.execute_behavior("ugv1", "goto", {"target": place}, by="anna")
            )
            for place in places
        )
        await asyncio.sleep(1)  # of virtual time, which waits for threads: both were read
        assert Call("cancel", f"{first}.b1") in world.fake.calls
        world.fake.report(f"{first}.b1", BehaviorState.CANCELLED)
        with pytest.raises(OperatorError, match="a later request"):
            await second
        run = await third
        await world.fake.until_called("start", f"{run}.b1")
        request = world.fake.requests[f"{run}.b1"]
        return await control.wait(first), request

    first, request = play(story, "ugv1")
    assert first.status is RunStatus.STOPPED
    assert "replaced by a later request" in first.detail
    assert request.parameters["target"].position[1] == -77.2


def test_stop_of_all_ends_it_and_leaves_the_resource_with_its_operator(play):
    async def story(world: World):
        control = world.executive.control
        await control.take("ugv1", by="anna")
        run = await control.execute_behavior("ugv1", "drive_stop", by="anna")
        await world.fake.until_called("start", f"{run}.b1")
        stopped = await control.stop_all(by="ben")
        await world.fake.until_called("cancel", f"{run}.b1")
        world.fake.report(f"{run}.b1", BehaviorState.CANCELLED)
        await control.wait(run)
        return stopped, run, await control.holders()

    stopped, run, holders = play(story, "ugv1")
    assert stopped == [run]
    assert holders == {"ugv1": "anna"}


def test_to_take_what_was_commanded_stops_that_and_fails_nothing(play):
    async def story(world: World):
        control = world.executive.control
        run = await control.execute_behavior("ugv1", "drive_stop", by="anna")
        await world.fake.until_called("start", f"{run}.b1")
        effects = await control.preview_take("ugv1")
        await control.take("ugv1", by="ben")
        await world.fake.until_called("cancel", f"{run}.b1")
        world.fake.report(f"{run}.b1", BehaviorState.CANCELLED)
        done = await control.wait(run)
        return effects, done, await control.holders(), await control.alerts()

    effects, done, holders, alerts = play(story, "ugv1")
    assert [str(each) for each in effects] == ["r1: drive_stop, which was commanded, is stopped"]
    assert done.status is RunStatus.STOPPED
    assert "ugv1 was taken by ben" in done.detail
    assert holders == {"ugv1": "ben"}
    assert list(alerts) == []
