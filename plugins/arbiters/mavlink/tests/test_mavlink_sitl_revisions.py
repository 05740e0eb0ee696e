"""Missions that are revised while real copters fly them: what the copters say of themselves, to
another ground station and in their logs, is what counts."""

import asyncio
import math
from collections.abc import Iterator
from pathlib import Path

import pytest
from mavlink_revised_copters import (
    AUTO,
    BRAKE,
    GUIDED,
    MOMENTS_OF_A_KILL,
    RTL,
    STEADY_M_S,
    STILL_M_S,
    WITHIN_S,
    Copter,
    Copters,
    Steps,
    drawn,
    executive,
    flies,
    flown,
    goes_on_at,
    goes_to,
    killed_and_resumed,
    lane,
    revise,
    until,
)

from m2pem.api import MissionControl, RunStatus, StampedRecord
from m2pem.engine import records as r
from m2pem.errors import OperatorError
from tests.executive import conftest

pytestmark = [pytest.mark.timeout(600), pytest.mark.sitl("M2PEM_ARDUCOPTER")]

UP = ("takeoff", {"altitude": "20 m"})
HIGHER = ("takeoff", {"altitude": "30 m"})
HOME: tuple[str, dict[str, object]] = ("return_to_launch", {})
EAST = [(22.5, 100.0), (22.5, 700.0)]
OLD = [(0.0, 60.0), (0.0, 600.0)]
NEW = [(-60.0, 120.0), (-60.0, 20.0)]
EXTRA = (-20.0, 0.0)
DRIFT_M = 1.5
IN_THE_MIDDLE = "Auto mission changed, restarted command"
"""What ArduPilot says when it goes on with another mission at the number of the same item."""

FIRST: Steps = [UP, flies("lane", "20 m"), HOME]
SECOND: Steps = [HIGHER, flies("other", "30 m"), HOME]
BEGUN = drawn(FIRST, SECOND, lane=lane(*OLD), other=lane(*EAST))
TURNED = drawn(
    [UP, flies("lane", "20 m"), goes_to(EXTRA), HOME],
    SECOND,
    lane=lane(*NEW),
    other=lane(*EAST),
)


@pytest.fixture
def copters(tmp_path: Path) -> Iterator[Copters]:
    started = Copters(tmp_path / "world")
    try:
        yield started
    finally:
        started.close()


async def both_fly(copters: Copters) -> None:
    """Return when both are on the long lines of their routes."""
    first, second = copters.both
    await until(flown(first, OLD[0][1] + 20))
    await until(flown(second, EAST[0][1] + 20))


def assert_was_not_disturbed(copter: Copter) -> None:
    """It flew the route of its one mission to the end, and nothing stopped it on the way."""
    begin, end = EAST[0][1] + 20, EAST[1][1] - 20
    slowest_m_s = copter.slowest_m_s(
        lambda sample: sample.mode == "AUTO" and sample.place[1] > begin,
        lambda sample: sample.place[1] > end,
    )
    assert slowest_m_s > STEADY_M_S
    log = copter.logged()
    assert log.uploads == 1
    assert [mode for mode in log.modes if mode not in (0, GUIDED)] == [AUTO, RTL]
    assert not copter.station.armed, "it has not landed"


def test_a_route_that_is_flown_is_changed_and_a_task_is_added(copters: Copters) -> None:
    first, second = copters.both

    async def main() -> None:
        async with executive(copters) as control:
            run = await control.start(BEGUN)
            await both_fly(copters)
            await revise(control, run, TURNED)
            assert (await control.wait(run)).status is RunStatus.COMPLETED

    asyncio.run(main())
    copters.close()
    assert_was_not_disturbed(second)
    for place in (*NEW, EXTRA):
        assert first.nearest_m(place) < 5.0, place
    assert max(each.place[1] for each in first.samples) < OLD[1][1] - 100.0
    log = first.logged()
    assert log.uploads == 2
    # It leaves AUTO before the upload, as ArduPilot goes on in the middle of a mission otherwise.
    assert IN_THE_MIDDLE not in log.texts
    assert [mode for mode in log.modes if mode != 0] == [GUIDED, AUTO, GUIDED, AUTO, GUIDED, RTL]
    assert not first.station.armed, "it has not landed"


def test_a_copter_on_its_route_goes_on_at_another_speed(copters: Copters) -> None:
    first, second = copters.both
    slow, fast = (
        drawn(
            [UP, flies("lane", "20 m", f"{speed} m/s"), HOME],
            SECOND,
            lane=lane(*OLD),
            other=lane(*EAST),
        )
        for speed in (3, 9)
    )

    async def main() -> None:
        async with executive(copters) as control:
            run = await control.start(BEGUN)
            await both_fly(copters)
            for new, speed_m_s in ((slow, 3.0), (fast, 9.0)):
                plan = await control.plan_revision(run, new)
                assert [(each.kind, each.element) for each in plan.effects] == [("adjusts", "A2")]
                await control.revise(run, new, plan.plan)
                await goes_on_at(first, speed_m_s)
            assert (await control.wait(run)).status is RunStatus.COMPLETED
            alerts = await control.alerts()
            assert not [each for each in alerts if each.code == "NOT_ADJUSTED"]

    asyncio.run(main())
    copters.close()
    assert_was_not_disturbed(second)
    assert first.nearest_m(OLD[1]) < 5.0
    log = first.logged()
    assert log.uploads == 1
    assert [mode for mode in log.modes if mode != 0] == [GUIDED, AUTO, RTL]
    assert not first.station.armed, "it has not landed"


def test_a_branch_that_is_flown_cannot_be_removed(copters: Copters) -> None:
    first, second = copters.both
    alone = drawn([UP], SECOND, other=lane(*EAST))

    async def main() -> None:
        async with executive(copters) as control:
            run = await control.start(BEGUN)
            await both_fly(copters)
            plan = await control.plan_revision(run, alone)
            (refusal,) = plan.refusals
            assert (refusal.element, refusal.resources) == ("A2", ("uav1",))
            assert "behavior single_vehicle_routing of uav1" in refusal.text
            with pytest.raises(OperatorError, match="a token is on script task A2"):
                await control.revise(run, alone, plan.plan)
            await until(flown(first, OLD[1][1] - 20))
            assert (await control.wait(run)).status is RunStatus.COMPLETED

    asyncio.run(main())
    copters.close()
    assert first.logged().uploads == 1
    assert_was_not_disturbed(second)


def within(element: str, *tasks: tuple[str, str]) -> tuple[str, str]:
    """A subprocess with tasks, one after the other."""
    inside = conftest.sequence(*tasks)
    inside = inside.replace('<process id="P" isExecutable="true">', f'<subProcess id="{element}">')
    for end in ("S", "E"):
        inside = inside.replace(f'id="{end}"', f'id="{element}{end}"')
        inside = inside.replace(f'Ref="{end}"', f'Ref="{element}{end}"')
    return element, inside.replace("</process>", "</subProcess>")


def step(element: str, behavior: str, **parameters: object) -> tuple[str, str]:
    values = "".join(
        f'<m2pem:property name="{name}" value="{value}"/>' for name, value in parameters.items()
    )
    return element, conftest.task(element, "vehicle='uav1'", behavior, values)


def test_a_subprocess_that_holds_a_token_is_replaced(copters: Copters) -> None:
    copter = copters.both[0]
    up, home = step("Up", *UP[:1], altitude="20 m"), step("Home", "return_to_launch")

    def visit(element: str, *places: tuple[float, float]) -> tuple[str, str]:
        return within(
            element,
            *(
                step(f"{element}{number}", goes_to(place)[0], **goes_to(place)[1])
                for number, place in enumerate(places, 1)
            ),
        )

    begun = conftest.mission(conftest.sequence(up, visit("Patrol", *OLD), home))
    other = conftest.mission(conftest.sequence(up, visit("Search", *NEW), home))

    async def main() -> None:
        async with executive(copters) as control:
            run = await control.start(begun)
            await until(lambda: copter.now.place[1] > OLD[0][1] + 20)
            (refusal,) = (await control.plan_revision(run, other)).refusals
            assert (refusal.element, refusal.resources) == ("Patrol", ("uav1",))
            assert "Search" in refusal.candidates
            await revise(control, run, other, Patrol="Search")
            assert (await control.wait(run)).status is RunStatus.COMPLETED

    asyncio.run(main())
    copters.close()
    for place in NEW:
        assert copter.nearest_m(place) < 5.0, place
    assert max(each.place[1] for each in copter.samples) < OLD[1][1] - 100.0
    assert [mode for mode in copter.logged().modes if mode != 0] == [GUIDED, RTL]
    assert not copter.station.armed, "it has not landed"


@pytest.mark.parametrize("wait_for", MOMENTS_OF_A_KILL)
def test_m2pem_is_killed_right_after_a_revision_and_resumed(
    copters: Copters, tmp_path: Path, wait_for: str
) -> None:
    first, second = copters.both
    missions = (BEGUN, TURNED)
    asked = killed_and_resumed(copters, tmp_path, missions, lambda: both_fly(copters), wait_for)
    assert_was_not_disturbed(second)
    for place in (*NEW, EXTRA):
        assert first.nearest_m(place) < 5.0, place
    log = first.logged()
    assert 2 <= log.uploads <= 2 + asked
    assert IN_THE_MIDDLE not in log.texts
    assert not first.station.armed, "it has not landed"


async def hover(copters: Copters, seconds: float) -> None:
    """Wait until both stop, and see that they stay so long where they are, by their own clocks."""
    await until(lambda: all(copter.now.speed_m_s < STILL_M_S for copter in copters.both))
    begun = [(copter, copter.now) for copter in copters.both]
    await until(lambda: all(copter.now.at_s > at.at_s + seconds for copter, at in begun))
    for copter, at in begun:
        for each in copter.since(at.at_s):
            assert each.mode == at.mode
            assert math.dist(each.place, at.place) < DRIFT_M, copter.name
            assert abs(each.height_m - at.height_m) < DRIFT_M, copter.name


def test_a_breakpoint_that_was_added_holds_both_until_an_operator_goes_on(
    copters: Copters,
) -> None:
    first, second = copters.both

    async def main() -> None:
        async with executive(copters) as control:
            run = await control.start(BEGUN)
            await both_fly(copters)
            await revise(control, run, TURNED)
            await control.set_breakpoints(run, ["A3"], by="anna")
            await _until_record(control, run, "paused")
            await until(lambda: second.now.mode == "BRAKE")
            await hover(copters, 30.0)
            (summary,) = await control.runs()
            assert summary.status is RunStatus.PAUSED
            assert first.nearest_m(NEW[1]) < 5.0
            assert first.nearest_m(EXTRA) > 15.0, "it is on the way already"
            await control.resume(run, by="anna")
            assert (await control.wait(run)).status is RunStatus.COMPLETED

    asyncio.run(main())
    copters.close()
    assert first.nearest_m(EXTRA) < 5.0
    assert second.nearest_m(EAST[1]) < 5.0
    assert second.logged().uploads == 1
    for copter in copters.both:
        assert not copter.station.armed, "it has not landed"


MOMENTS = ["at once", "revised", "requested", "under way"]


def test_a_stop_in_the_middle_of_a_revision_reaches_all(copters: Copters) -> None:
    async def main() -> None:
        async with executive(copters) as control:
            run = await control.start(drawn([UP], [HIGHER]))
            assert (await control.wait(run)).status is RunStatus.COMPLETED
            for number, moment in enumerate(MOMENTS):
                await stopped(control, moment, 60.0 + 100.0 * number)
                await until(lambda: all(copter.now.mode == "BRAKE" for copter in copters.both))
                await hover(copters, 15.0)
            run = await control.start(drawn([HOME], [HOME]))
            assert (await control.wait(run)).status is RunStatus.COMPLETED

    async def stopped(control: MissionControl, moment: str, north_m: float) -> None:
        """Both fly north; the route of the one is changed, and all are stopped meanwhile."""
        other = flies("other", "30 m")
        there = lane((22.5, north_m), (22.5, north_m + 900.0))
        begun = drawn(
            [flies("lane", "20 m")],
            [other],
            lane=lane((0.0, north_m), (0.0, north_m + 900.0)),
            other=there,
        )
        new = drawn([flies("lane", "20 m")], [other], lane=lane((-300.0, 0.0)), other=there)
        run = await control.start(begun)
        for copter in copters.both:
            await until(flown(copter, north_m + 5.0))
        plan = await control.plan_revision(run, new)
        revision = asyncio.create_task(control.revise(run, new, plan.plan))
        if moment == "at once":
            await asyncio.sleep(0)  # so that it is under way
        else:
            await _until_record(control, run, moment)
        await control.stop_all(by="anna")
        if moment == "at once":
            await asyncio.gather(revision, return_exceptions=True)  # the stop may come first
        else:
            await revision
        assert (await control.wait(run)).status is RunStatus.STOPPED

    asyncio.run(main())
    copters.close()
    for copter in copters.both:
        assert copter.logged().modes.count(BRAKE) >= len(MOMENTS)
        assert not copter.station.armed, "it has not landed"


async def _until_record(control: MissionControl, run: str, moment: str) -> None:
    """Return when the run has a record of the revision, or of the task that begins again."""
    requested, revised = "", False
    async with asyncio.timeout(WITHIN_S):
        async for event in control.subscribe(run):
            record = event.record if isinstance(event, StampedRecord) else None
            match record:
                case r.RunPaused() if moment == "paused":
                    return
                case r.MissionRevised():
                    revised = True
                    if moment == "revised":
                        return
                case r.BehaviorRequested() if revised:
                    requested = record.behavior
                    if moment == "requested":
                        return
                case r.BehaviorProgressed(state="RUNNING") if record.behavior == requested:
                    return
