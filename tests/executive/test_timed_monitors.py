"""Requirements about mission time and telemetry, in runs."""

from collections.abc import Callable
from typing import Any

import pytest

from m2pem.api.telemetry import GeoPosition, VehicleState
from m2pem.engine import inputs
from m2pem.engine.records import Record, RequirementDecided, TelemetryConditionChanged
from m2pem.geo.local_frame import offset
from m2pem.mission.catalogue import ResourceId

from .conftest import START_US, World
from .test_run_monitors import (
    SATISFIED,
    VIOLATED,
    answered,
    asking,
    decided,
    left_behind,
    left_open,
    requirement,
)

CLOSE = "[] ![][0 s, 5 s] distance(uav1, uav2) < 5 m"
HOME = (38.1, -77.3)


def decisions(records: list[Record]) -> list[tuple[str, str, float]]:
    return [
        (each.requirement, each.verdict.value, each.decided_us / 1e6)
        for each in records
        if type(each) is RequirementDecided
    ]


def at(world: World, vehicle: str, east_m: float, **more: Any) -> None:
    """The vehicle says that it is so far east of its home."""
    latitude, longitude = offset(HOME, east_m, 0.0)
    place = GeoPosition(latitude, longitude, 30.0)
    state = VehicleState(ResourceId(vehicle), world.clock.now_us(), place, **more)
    world.fake.say(state)


def test_an_answer_that_is_late_violates_a_deadline_when_it_is_over(
    play: Callable[..., Any],
) -> None:
    source = asking(
        requirement("soon", "[](active(First) -> <>[0 s, 30 s] active(Second))"),
        requirement("later", "[](active(First) -> <>[0 s, 90 s] active(Second))"),
    )

    async def story(world: World) -> list[Record]:
        control = world.executive.control
        run = await control.start(source)
        await world.clock.sleep(60)
        await control.answer(run, control.prompts()[0].prompt, "yes", by="anna")
        await world.clock.sleep(1)
        await control.answer(run, control.prompts()[0].prompt, "yes", by="anna")
        await control.wait(run)
        return world.seen

    assert decisions(play(story)) == [("soon", "violated", 30.0), ("later", "satisfied", 61.0)]


def test_mission_time_stops_in_a_pause(play: Callable[..., Any]) -> None:
    source = asking(requirement("soon", "<>[0 s, 30 s] active(Second)"))

    async def story(world: World) -> list[Record]:
        control = world.executive.control
        run = await control.start(source)
        await world.clock.sleep(20)
        await control.pause(run, by="anna")
        await world.clock.sleep(100)
        await control.resume(run, by="anna")
        await world.clock.sleep(5)
        await control.answer(run, control.prompts()[0].prompt, "yes", by="anna")
        await world.clock.sleep(1)
        return world.seen

    assert decided(play(story)) == {"soon": SATISFIED}


def test_vehicles_that_are_close_for_a_while_violate_their_distance(
    play: Callable[..., Any],
) -> None:
    source = asking(requirement("apart", CLOSE))

    async def story(world: World) -> tuple[list[Record], int]:
        await world.executive.control.start(source)
        at(world, "uav2", 0.0)
        for east_m in (20, 4, 4, 4, 20, 4, 3, 4, 3, 4, 3, 4, 3):
            await world.clock.sleep(1)
            at(world, "uav1", float(east_m))
        await world.clock.sleep(3)
        changes = sum(type(each) is TelemetryConditionChanged for each in world.seen)
        return world.seen, changes

    seen, changes = play(story, "uav1", "uav2")
    assert decisions(seen) == [("apart", "violated", 11.0)]
    assert changes == 4


def test_what_is_not_known_violates_nothing(play: Callable[..., Any]) -> None:
    source = asking(requirement("charged", "[] battery(uav1) > 20 %"))

    async def story(world: World) -> list[Record]:
        await world.executive.control.start(source)
        await world.clock.sleep(10)
        assert decided(world.seen) == {}
        at(world, "uav1", 0.0, battery_fraction=0.5)
        await world.clock.sleep(1)
        assert decided(world.seen) == {}
        at(world, "uav1", 0.0, battery_fraction=0.19)
        await world.clock.sleep(1)
        return world.seen

    assert decided(play(story, "uav1")) == {"charged": VIOLATED}


@pytest.mark.parametrize(("close_s", "expected"), [(4.0, []), (6.0, [("apart", "violated")])])
def test_an_outage_of_the_executive_is_no_evidence(
    play: Callable[..., Any], close_s: float, expected: list[tuple[str, str]]
) -> None:
    """Close as the executive dies, and close again when another one has taken the run up: only
    what was seen counts."""
    changed = inputs.TelemetryConditionChanged("distance(uav1, uav2) < 5 m", True)
    journal = left_behind(
        asking(requirement("safe", CLOSE)), changed, formula=CLOSE, vehicles=("uav1", "uav2")
    )

    async def story(world: World) -> list[Record]:
        await world.executive.resume("r1")
        at(world, "uav2", 0.0)
        at(world, "uav1", 4.0)
        await world.clock.sleep(close_s)
        at(world, "uav1", 20.0)
        await world.clock.sleep(20)
        return world.seen

    seen = play(story, "uav1", "uav2", journal=journal, start_us=START_US + 3_000_000)
    assert [(each, verdict) for each, verdict, _ in decisions(seen)] == [
        ("safe", verdict) for _, verdict in expected
    ]


CHARGED = asking(requirement("charged", "[] battery(uav1) > 20 %"))


def test_what_telemetry_said_before_the_start_counts_from_the_first_moment_on(
    play: Callable[..., Any],
) -> None:
    async def story(world: World) -> list[Record]:
        at(world, "uav1", 0.0, battery_fraction=0.5)
        await world.clock.sleep(1)
        await answered(world, CHARGED)
        await world.clock.sleep(1)
        return world.seen

    seen = play(story, "uav1")
    assert (decided(seen), left_open(seen)) == ({"charged": SATISFIED}, {})


@pytest.mark.parametrize(
    ("battery", "why"),
    [
        (None, "nothing was known of uav1's battery"),
        (0.5, "uav1's battery was not known all the time"),
    ],
)
def test_the_end_says_what_was_not_known(
    play: Callable[..., Any], battery: float | None, why: str
) -> None:
    async def story(world: World) -> list[Record]:
        control = world.executive.control
        run = await control.start(CHARGED)
        await world.clock.sleep(1)
        at(world, "uav1", 0.0, battery_fraction=battery)
        await world.clock.sleep(1)
        for _ in range(2):
            await control.answer(run, control.prompts()[0].prompt, "yes", by="anna")
            await world.clock.sleep(1)
        await control.wait(run)
        return world.seen

    seen = play(story, "uav1")
    assert (decided(seen), left_open(seen)) == ({}, {"charged": why})
