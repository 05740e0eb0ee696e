"""What a team is told reaches all its members at once, whatever one of them makes of it."""

from collections.abc import Mapping
from typing import Any, ClassVar

import pytest

from m2pem.api.arbiter import BehaviorId, BehaviorRequest, ResolvedValue
from m2pem.api.runs import RunStatus
from m2pem.engine.records import BehaviorEnded
from m2pem.executive.dispatcher import CALL_TIMEOUT_S
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.simulation.arbiters import SimArbiter

from .conftest import one_task, route
from .rehearsed import Rehearsed, rehearsed, sim_fleet

TEN = "abcdefghij"
BOUND_US = 200_000
ANSWERS_S = 0.1
COLUMN = {name: (-20.0 * rank, 0.0) for rank, name in enumerate(TEN)}
ROAD = {"road": route((50, 0), (450, 0))}
MARCH = one_task("road_following_formation", route="road", spacing="20 m", speed="4 m/s")
FOR_EVER_S = 3600.0


class SlowArbiter(SimArbiter):
    """Each call takes `ANSWERS_S`, and does what it is asked for at the end of that.

    `slow`: other times, by (call, vehicle). `refuses`: calls that raise. `heard`: when each call
    came.
    """

    slow: ClassVar[dict[tuple[str, str], float]] = {}
    refuses: ClassVar[set[tuple[str, str]]] = set()
    heard: ClassVar[list[tuple[str, str, int]]] = []

    async def _hear(self, call: str, vehicle: str) -> None:
        self.heard.append((call, vehicle, self._clock.now_us()))
        await self._clock.sleep(self.slow.get((call, vehicle), ANSWERS_S))
        if (call, vehicle) in self.refuses:
            raise OSError("it will not")

    async def start(self, request: BehaviorRequest) -> None:
        await self._hear("start", request.resources[0])
        await super().start(request)

    async def cancel(self, behavior: BehaviorId, epoch: int) -> None:
        await self._hear("cancel", behavior.rpartition(".")[2])
        await super().cancel(behavior, epoch)

    async def adjust(
        self, behavior: BehaviorId, epoch: int, parameters: Mapping[str, ResolvedValue]
    ) -> None:
        await self._hear("adjust", behavior.rpartition(".")[2])
        await super().adjust(behavior, epoch, parameters)

    async def hold(self, resource: ResourceId) -> None:
        await self._hear("hold", resource)
        await super().hold(resource)

    async def resume(self, resource: ResourceId) -> None:
        await self._hear("resume", resource)
        await super().resume(resource)


@pytest.fixture(autouse=True)
def anew() -> None:
    SlowArbiter.slow, SlowArbiter.refuses, SlowArbiter.heard = {}, set(), []


def told(call: str, since_us: int) -> dict[str, int]:
    """Who heard a call since then, and how long after it."""
    found: dict[str, int] = {}
    for name, vehicle, at_us in SlowArbiter.heard:
        if name == call and at_us >= since_us:
            found.setdefault(vehicle, at_us - since_us)
    return found


def all_in_time(call: str, since_us: int, names: str = TEN) -> None:
    heard = told(call, since_us)
    assert set(names) <= set(heard), f"{call} reached {heard} alone"
    late = {name: heard[name] for name in names if heard[name] > BOUND_US}
    assert not late, f"{call} came late to {late}"


def play(story: Any) -> Any:
    return rehearsed(sim_fleet(COLUMN, ROAD), story, kind=SlowArbiter)


@pytest.mark.parametrize("after_s", [0.05, 0.15, 0.3, 5.0, 17.3, 40.0])
@pytest.mark.parametrize("hangs", ["", "hold", "resume", "cancel", "adjust"])
def test_hold_resume_and_cancel_reach_ten_members_within_the_bound(
    after_s: float, hangs: str
) -> None:
    """`hangs`: a call in which e does not come back; all others hear in time all the same."""
    rest = TEN.replace("e", "") if hangs else TEN

    async def story(world: Rehearsed) -> None:
        control, clock = world.executive.control, world.clock
        run = await control.start(MARCH)
        await clock.sleep(after_s)
        SlowArbiter.slow = {(hangs, "e"): FOR_EVER_S} if hangs else {}
        now_us = clock.now_us()
        await control.pause(run)
        await clock.sleep(1.0)
        all_in_time("hold", now_us)
        now_us = clock.now_us()
        await control.resume(run)
        await clock.sleep(1.0)
        all_in_time("resume", now_us, rest)
        now_us = clock.now_us()
        await control.stop(run)
        await clock.sleep(1.0)
        all_in_time("cancel", now_us, rest)
        await control.wait(run)

    play(story)


def test_a_cancel_overtakes_a_member_that_hangs_in_its_hold() -> None:
    async def story(world: Rehearsed) -> None:
        control, clock = world.executive.control, world.clock
        run = await control.start(MARCH)
        await clock.sleep(20)
        SlowArbiter.slow = {("hold", "e"): FOR_EVER_S}
        await control.pause(run)
        await clock.sleep(0.5)
        now_us = clock.now_us()
        await control.stop(run)
        await clock.sleep(1.0)
        all_in_time("cancel", now_us)
        await control.wait(run)

    play(story)


def stand_at_the_end(world: Rehearsed, names: str) -> list[float]:
    return [world.speed_m_s(name) for name in names]


async def failed(world: Rehearsed, names: str) -> tuple[BehaviorEnded, list[float]]:
    """The end of the team's behavior, and how fast the others were when it was recorded."""
    speeds: list[float] = []
    for _ in range(20 * 120):
        if world.ended():
            return world.ended()[0], speeds
        speeds = [world.speed_m_s(name) for name in names]
        await world.clock.sleep(0.05)
    raise AssertionError(f"no end was recorded; {world.seen[-5:]}")


def test_a_member_that_refuses_to_begin_fails_the_team_when_the_others_stand() -> None:
    SlowArbiter.refuses = {("start", "e")}
    SlowArbiter.slow = {("start", "e"): 2.0}  # when the others are well under way

    async def story(world: Rehearsed) -> Any:
        run = await world.executive.control.start(MARCH)
        await world.clock.sleep(1.9)
        assert world.speed_m_s("a") > 1
        return await failed(world, "abcd"), await world.executive.control.wait(run)

    (ended, speeds), summary = play(story)
    assert (ended.state, ended.code) == (BehaviorState.FAILED, "REJECTED")
    assert ended.reason == "e: its arbiter raised OSError: it will not"
    assert speeds == [0, 0, 0, 0]
    assert summary.status is RunStatus.FAILED


@pytest.mark.parametrize("how", ["raises", "hangs"])
@pytest.mark.parametrize("call", ["hold", "resume"])
def test_a_member_that_is_not_held_or_let_go_fails_the_team_when_the_others_stand(
    call: str, how: str
) -> None:
    others = TEN.replace("e", "")

    async def story(world: Rehearsed) -> Any:
        control, clock = world.executive.control, world.clock
        run = await control.start(MARCH)
        await clock.sleep(30)
        if how == "raises":
            SlowArbiter.refuses = {(call, "e")}
        else:
            SlowArbiter.slow = {(call, "e"): FOR_EVER_S}
        await control.pause(run)
        if call == "resume":
            await clock.sleep(20)
            await control.resume(run)
        now_us = clock.now_us()
        await clock.sleep(CALL_TIMEOUT_S + 10)
        stand = [world.speed_m_s(name) for name in TEN]
        if call == "hold":
            await control.resume(run)
        summary = await control.wait(run)
        return summary.status, world.ended(), stand, told("cancel", now_us)

    status, (ended,), stand, cancelled = play(story)
    assert status is RunStatus.FAILED
    assert (ended.state, ended.code) == (BehaviorState.FAILED, "FAILED")
    assert ended.reason.startswith("e: it was not ")
    assert stand == [0] * len(TEN)
    assert set(others) <= set(cancelled)


def test_a_member_that_hangs_at_its_start_fails_the_team_and_the_others_have_stood_meanwhile() -> (
    None
):
    SlowArbiter.slow = {("start", "e"): FOR_EVER_S}

    async def story(world: Rehearsed) -> Any:
        run = await world.executive.control.start(MARCH)
        found = await failed(world, "abcd")
        return found, await world.executive.control.wait(run)

    (ended, speeds), summary = play(story)
    assert (ended.state, ended.code) == (BehaviorState.FAILED, "REJECTED")
    assert ended.reason.startswith("e: its arbiter did not return within 10 s")
    # They crawl with 0.3 m/s at least, and brake from that within 0.15 s of a cancel.
    assert max(speeds) < 0.2
    assert summary.status is RunStatus.FAILED
