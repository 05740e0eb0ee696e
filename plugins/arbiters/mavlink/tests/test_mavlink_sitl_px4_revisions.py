"""Missions that are revised while a real PX4 flies them: what it says of itself to another ground
station is what counts."""

import asyncio
import math
from collections.abc import Iterator
from pathlib import Path

import pytest
from mavlink_revised_copters import (
    MOMENTS_OF_A_KILL,
    STEADY_M_S,
    Copter,
    Copters,
    Place,
    Steps,
    drawn,
    executive,
    flies,
    flown,
    goes_on_at,
    goes_to,
    killed_and_resumed,
    landed,
    lane,
    revise,
    until,
)

from m2pem.api import RunStatus

pytestmark = [pytest.mark.timeout(600), pytest.mark.sitl("M2PEM_PX4")]

UP = ("takeoff", {"altitude": "20 m"})
HOME: tuple[str, dict[str, object]] = ("return_to_launch", {})
OLD = [(0.0, 60.0), (0.0, 600.0)]
NEW = [(-60.0, 120.0), (-60.0, 20.0), (-110.0, 20.0)]
EXTRA = (-20.0, 0.0)
THERE_M = 10.5
"""PX4 has reached a waypoint at NAV_ACC_RAD, 10 m."""

FIRST: Steps = [UP, flies("lane", "20 m"), HOME]
THEN: Steps = [UP, flies("lane", "20 m"), goes_to(EXTRA), HOME]
BEGUN = drawn(FIRST, lane=lane(*OLD))
TURNED = drawn(THEN, lane=lane(*NEW))
SHORT = [(0.0, 60.0), (0.0, 250.0)]


@pytest.fixture
def copters(tmp_path: Path) -> Iterator[Copters]:
    started = Copters(tmp_path / "world", "px4")
    try:
        yield started
    finally:
        started.close()


async def on_its_way(copter: Copter) -> None:
    """Return when it is on the long line of its route, at the second waypoint of it."""
    await until(flown(copter, OLD[0][1] + 20))


def assert_in_order(copter: Copter, *places: Place, since_s: float) -> None:
    """It reached them one after the other, and went on to none of the old route."""
    at_s = [copter.first_at_s(place, THERE_M, since_s) for place in places]
    assert math.inf not in at_s, at_s
    assert at_s == sorted(at_s)
    turned_s = at_s[0]
    assert max(each.place[1] for each in copter.samples) < OLD[1][1] - 100.0
    assert max(each.place[1] for each in copter.since(turned_s)) < NEW[0][1] + 30.0


@pytest.mark.tried_with(
    "PX4",
    "a mission is revised while it is flown",
    kind="Autopilots",
    result="goes on with the new route",
    version="main of August 2026",
    on="2026-11",
)
def test_a_route_that_is_flown_is_changed_and_a_task_is_added(copters: Copters) -> None:
    (copter,) = copters.all
    revised_s = 0.0

    async def main() -> None:
        nonlocal revised_s
        async with executive(copters) as control:
            run = await control.start(BEGUN)
            await on_its_way(copter)
            await revise(control, run, TURNED)
            revised_s = copter.now.at_s
            assert (await control.wait(run)).status is RunStatus.COMPLETED
        await landed(copters)

    asyncio.run(main())
    copters.close()
    assert_in_order(copter, *NEW, EXTRA, since_s=revised_s)
    assert len(copter.missions) == 2
    there_s = copter.first_at_s(NEW[0], THERE_M, revised_s)
    turning = [each.speed_m_s for each in copter.since(revised_s) if each.at_s < there_s]
    assert min(turning) > STEADY_M_S
    assert copter.modes.count("MISSION") == 1, "it stays in its mode"


def test_a_copter_on_its_route_goes_on_at_another_speed(copters: Copters) -> None:
    (copter,) = copters.all

    async def main() -> None:
        async with executive(copters) as control:
            run = await control.start(BEGUN)
            await on_its_way(copter)
            for speed_m_s in (3.0, 9.0):
                steps: Steps = [UP, flies("lane", "20 m", f"{speed_m_s:g} m/s"), HOME]
                new = drawn(steps, lane=lane(*OLD))
                plan = await control.plan_revision(run, new)
                assert [(each.kind, each.element) for each in plan.effects] == [("adjusts", "A2")]
                await control.revise(run, new, plan.plan)
                await goes_on_at(copter, speed_m_s)
            assert (await control.wait(run)).status is RunStatus.COMPLETED
            alerts = await control.alerts()
            assert not [each for each in alerts if each.code == "NOT_ADJUSTED"]
        await landed(copters)

    asyncio.run(main())
    copters.close()
    assert copter.nearest_m(OLD[1]) < THERE_M
    assert len(copter.missions) == 1


@pytest.mark.parametrize("wait_for", MOMENTS_OF_A_KILL)
def test_m2pem_is_killed_right_after_a_revision_and_resumed(
    copters: Copters, tmp_path: Path, wait_for: str
) -> None:
    (copter,) = copters.all
    revised_s = 0.0

    async def flying() -> None:
        nonlocal revised_s
        await on_its_way(copter)
        revised_s = copter.now.at_s

    killed_and_resumed(copters, tmp_path, (BEGUN, TURNED), flying, wait_for)
    assert_in_order(copter, *NEW, EXTRA, since_s=revised_s)
    assert len(copter.missions) == 2


@pytest.mark.parametrize("wait_for", ["BehaviorRequested", "ACCEPTED", "RUNNING"])
def test_a_route_that_begins_again_is_flown_from_its_first_waypoint_after_a_kill(
    copters: Copters, tmp_path: Path, wait_for: str
) -> None:
    """PX4 ignores the upload of the mission that it has: it shows nothing of it."""
    (copter,) = copters.all
    revised_s = 0.0

    async def flying() -> None:
        nonlocal revised_s
        await on_its_way(copter)
        revised_s = copter.now.at_s

    missions = (drawn(FIRST, lane=lane(*SHORT)), drawn(THEN, lane=lane(*SHORT)))
    killed_and_resumed(copters, tmp_path, missions, flying, wait_for, ["A2=A2"])
    first_s, last_s = (copter.first_at_s(place, THERE_M, revised_s) for place in SHORT)
    assert first_s < last_s < math.inf, "its first waypoint was skipped"
    assert len(copter.missions) == 1
