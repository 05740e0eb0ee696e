"""A revision of which only a speed differs: simulated vehicles go on at that speed."""

import asyncio
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pytest

from m2pem.api.arbiter import BehaviorReport
from m2pem.api.telemetry import VehicleState
from m2pem.engine.inputs import BehaviorReported, Revise
from m2pem.fleet.fleet import Domain
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.mission import version_of_files
from m2pem.testing import scenarios
from m2pem.testing.fake_arbiter import FakeArbiter

from .conftest import Fakes, World, behavior, mission, sequence
from .test_emergency import alerts
from .test_recovery import left_behind, resumed

HOMES = {"ugv1": [38.1075, -77.3192], "ugv2": [38.11, -77.31]}
FLEET = scenarios.fleet("sim", {name: {"home": home} for name, home in HOMES.items()})
FAR = '<m2pem:property name="target" value="[38.2, -77.3192]"/>'


def drives(*speeds: str) -> bytes:
    """Drives to the same place, one after the other, each at its speed."""
    tasks = {}
    for number, speed in enumerate(speeds, 1):
        parameters = FAR + f'<m2pem:property name="speed" value="{speed}"/>'
        element = f"Go{number}"
        tasks[element] = behavior(element, "goto", "ugv1", parameters=parameters)
    return mission(sequence(*tasks.items()))


SLOW, FAST = drives("2 m/s"), drives("4 m/s")


async def reaches(world: World, speed_m_s: float) -> None:
    """Return when the vehicle is that fast, and goes on so."""
    async for state in world.executive.control.telemetry():
        velocity = state.velocity_enu_m_s if isinstance(state, VehicleState) else None
        if velocity is not None and math.hypot(*velocity) == pytest.approx(speed_m_s, abs=0.01):
            return


async def revised(world: World, run: str, new: bytes) -> str:
    """Revise the run by its plan; the kind of the one effect."""
    plan = await world.executive.control.plan_revision(run, new)
    (effect,) = plan.effects
    await world.executive.control.revise(run, new, plan.plan)
    return effect.kind


def names(world: World) -> list[str]:
    return [each for each in world.names() if each.startswith("Behavior")]


def test_a_vehicle_goes_on_at_the_speed_of_the_new_version(play):
    async def story(world: World):
        run = await world.executive.control.start(SLOW)
        await reaches(world, 2.0)
        assert await revised(world, run, FAST) == "adjusts"
        await reaches(world, 4.0)
        assert await revised(world, run, SLOW) == "adjusts"
        await reaches(world, 2.0)
        return names(world)

    found = play(story, fleet=FLEET)
    assert found.count("BehaviorRequested") == 1
    assert found.count("BehaviorAdjusted") == 2
    assert "BehaviorCancelRequested" not in found


def test_a_vehicle_that_is_held_has_the_speed_when_the_run_is_resumed(play):
    async def story(world: World):
        control = world.executive.control
        run = await control.start(SLOW)
        await reaches(world, 2.0)
        await control.pause(run)
        await reaches(world, 0.0)
        assert await revised(world, run, FAST) == "adjusts"
        await world.clock.sleep(30.0)
        assert world.names()[-1] == "BehaviorAdjusted", "it is held"
        await control.resume(run)
        await reaches(world, 4.0)

    play(story, fleet=FLEET)


def test_a_task_that_has_not_begun_begins_with_the_speed_of_the_new_version(play):
    async def story(world: World):
        run = await world.executive.control.start(drives("2 m/s", "2 m/s"))
        await reaches(world, 2.0)
        plan = await world.executive.control.plan_revision(run, drives("2 m/s", "3 m/s"))
        return plan.effects

    assert play(story, fleet=FLEET) == ()


def test_where_vehicles_share_space_the_task_begins_again(play):
    async def story(world: World):
        run = await world.executive.control.start(SLOW)
        await reaches(world, 2.0)
        return await revised(world, run, FAST)

    shared = replace(FLEET, surface_separation_m={Domain.GROUND: 5.0})
    assert play(story, fleet=shared) == "restarts"


class Adjusting(FakeArbiter):
    """Changes the speed of what goes on, or raises. With `answering`, its vehicles answer when a
    test sets the result of the last of `answers`."""

    capabilities = replace(FakeArbiter.capabilities, adjusts=True)
    broken = False
    answering = False

    def __init__(self, connections: Any, context: Any) -> None:
        super().__init__(connections, context)
        self.answers: list[asyncio.Future[str]] = []

    async def adjust(
        self, behavior: str, epoch: int, parameters: Mapping[str, Any]
    ) -> asyncio.Future[str] | None:
        await self._called("adjust", f"{behavior} {epoch} {dict(parameters)}")
        if self.broken:
            raise OSError("no link")
        if not self.answering:
            return None
        self.answers.append(asyncio.get_running_loop().create_future())
        return self.answers[-1]


@pytest.fixture
def adjusting(monkeypatch: pytest.MonkeyPatch) -> None:
    """The fake arbiter can change speeds."""

    def make(self: Fakes, connections: Any, context: Any) -> FakeArbiter:
        self.made.append(Adjusting(connections, context))
        return self.made[-1]

    monkeypatch.setattr(Fakes, "make", make)


@pytest.mark.usefixtures("adjusting")
def test_operators_read_of_a_vehicle_whose_arbiter_fails(play):
    async def story(world: World):
        world.fake.broken = True
        run = await world.executive.control.start(SLOW)
        await world.fake.until_called("start", "r1.b1")
        world.fake.report("r1.b1", BehaviorState.RUNNING)
        await world.clock.sleep(0.1)
        alert = asyncio.create_task(alerts(world, "NOT_ADJUSTED"))
        assert await revised(world, run, FAST) == "adjusts"
        return await alert, world.fake.count("adjust", "r1.b1 1 {'speed': 4.0}")

    alert, calls = play(story, "ugv1")
    assert calls == 1
    assert alert.resources == ("ugv1",)
    assert alert.text == (
        "ugv1 may keep the speed that goto had before the revision: the arbiter raised OSError: "
        "no link"
    )


async def adjusted(world: World) -> str:
    """Start the mission, and revise its speed; the run. The vehicle has not answered yet."""
    world.fake.answering = True
    run = await world.executive.control.start(SLOW)
    await world.fake.until_called("start", "r1.b1")
    world.fake.report("r1.b1", BehaviorState.RUNNING)
    await world.clock.sleep(0.1)
    assert await revised(world, run, FAST) == "adjusts"
    await world.fake.until_called("adjust", "r1.b1 1 {'speed': 4.0}")
    await world.clock.sleep(0.1)
    return run


async def listed(world: World) -> list[str]:
    """The texts of the alerts of vehicles that may keep their speed."""
    found = await world.executive.control.alerts()
    return [each.text for each in found if each.code == "NOT_ADJUSTED"]


@pytest.mark.usefixtures("adjusting")
def test_operators_read_what_the_vehicle_answers(play):
    async def story(world: World):
        await adjusted(world)
        await world.clock.sleep(20.0)
        assert await listed(world) == [], "it may still take it"
        world.fake.answers[-1].set_result("its motors are hot")
        await world.clock.sleep(0.1)
        return await listed(world)

    assert play(story, "ugv1") == [
        "ugv1 may keep the speed that goto had before the revision: its motors are hot"
    ]


@pytest.mark.usefixtures("adjusting")
def test_a_speed_that_is_taken_is_no_alert(play):
    async def story(world: World):
        await adjusted(world)
        world.fake.answers[-1].set_result("")
        await world.clock.sleep(100.0)
        return await listed(world)

    assert play(story, "ugv1") == []


@pytest.mark.usefixtures("adjusting")
def test_operators_read_of_a_vehicle_that_does_not_answer(play):
    async def story(world: World):
        await adjusted(world)
        await world.clock.sleep(100.0)
        return await listed(world)

    (text,) = play(story, "ugv1")
    assert text.endswith("there is no answer after 60 s")


@pytest.mark.usefixtures("adjusting")
def test_operators_read_of_an_arbiter_that_fails_later(play):
    async def story(world: World):
        await adjusted(world)
        world.fake.answers[-1].set_exception(OSError("no link"))
        await world.clock.sleep(0.1)
        return await listed(world)

    (text,) = play(story, "ugv1")
    assert text.endswith("the arbiter raised OSError: no link")


@pytest.mark.usefixtures("adjusting")
def test_the_answer_to_an_earlier_speed_does_not_matter(play):
    async def story(world: World):
        run = await adjusted(world)
        assert await revised(world, run, drives("3 m/s")) == "adjusts"
        await world.fake.until_called("adjust", "r1.b1 1 {'speed': 3.0}")
        await world.clock.sleep(0.1)
        assert world.fake.answers[0].cancelled()
        world.fake.answers[1].set_result("its motors are hot")
        await world.clock.sleep(0.1)
        return await listed(world)

    assert len(play(story, "ugv1")) == 1


@pytest.mark.usefixtures("adjusting")
def test_a_cancel_does_not_wait_for_the_answer(play):
    async def story(world: World):
        run = await adjusted(world)
        restarted = mission(sequence(("Go1", behavior("Go1", "drive_stop", "ugv1"))))
        assert await revised(world, run, restarted) == "restarts"
        await world.fake.until_called("cancel", "r1.b1")
        assert not world.fake.answers[-1].done()
        world.fake.answers[-1].set_result("its motors are hot")
        await world.clock.sleep(0.1)
        assert await listed(world) == [], "it is over"
        world.fake.report("r1.b1", BehaviorState.CANCELLED)
        await world.clock.sleep(0.1)

    play(story, "ugv1")


@pytest.mark.usefixtures("adjusting")
def test_what_has_ended_need_not_answer(play):
    async def story(world: World):
        run = await adjusted(world)
        world.fake.report("r1.b1", BehaviorState.SUCCEEDED)
        await world.executive.control.wait(run)
        assert world.fake.answers[-1].cancelled()
        return await listed(world)

    assert play(story, "ugv1") == []


@pytest.mark.usefixtures("adjusting")
def test_an_executive_that_died_before_the_arbiter_got_it_sends_it_again(play):
    async def plan(world: World):
        run = await world.executive.control.start(SLOW)
        await world.fake.until_called("start", "r1.b1")
        return (await world.executive.control.plan_revision(run, FAST)).plan

    digest = play(plan, "ugv1")
    item = Revise(version_of_files(FAST, ()), "m", FAST, digest, adjustable=("r1.b1",))
    journal = left_behind(SLOW, BehaviorReported("r1.b1", 1, BehaviorState.RUNNING), item)

    async def story(world: World):
        await world.fake.until_called("adjust", "r1.b1 2 {'speed': 4.0}")
        return world.fake.count("start")

    known = {"r1.b1": BehaviorReport("r1.b1", 2, BehaviorState.RUNNING)}
    assert resumed(play, journal, story, known=known) == 0
