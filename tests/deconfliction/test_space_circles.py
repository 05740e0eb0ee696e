"""Tasks that wait for each other in a circle, some of them for space: operators are warned of it
when it closes, and what the warning says ends it."""

import asyncio
import re
from typing import Any

import pytest

from m2pem.api.runs import Alert, RunStatus
from m2pem.engine.records import AllocationDelayed
from m2pem.fleet.fleet import SharedSpace
from tests.executive.conftest import mission, sequence, task
from tests.waiting_circle import GO, NONE_GOES_ON, holding_and_waiting

from .conftest import Play, World
from .sky import area, place

HOMES = {"one": (0.0, 0.0), "two": (100.0, 30.0), "three": (-20.0, 0.0)}
BRIDGE = {"bridge": area((40, -5), (60, -5), (60, 5), (40, 5))}


def given(**parameters: str) -> str:
    return "".join(f'<m2pem:property name="{k}" value="{v}"/>' for k, v in parameters.items())


def at(east: float, north: float) -> str:
    return f"[{', '.join(map(str, place(east, north)[:2]))}]"


OVER = given(target=at(100, 0), speed="2 m/s")
BACK = given(target=at(0, 0), speed="2 m/s")
CATCH = (
    '<intermediateCatchEvent id="Q"><signalEventDefinition signalRef="Sig"/>'
    "</intermediateCatchEvent>"
)
FOLLOW = ("follow", given(target="three"))
"""It needs a place in each shared space."""


def crosses(role: str) -> bytes:
    return mission(sequence(("Over", task("Over", role, "goto", OVER))))


def play_on_bridge(play: Play, story: Any) -> Any:
    space = {"bridge": SharedSpace("bridge", 1)}
    policy = {"vertical_separation_m": None, "shared_space": space}
    return play(story, HOMES, geometries=BRIDGE, policy=policy, ground=tuple(HOMES))


async def waits(world: World, run: str) -> None:
    await world.until(
        lambda: any(
            isinstance(each, AllocationDelayed) and each.allocation.startswith(f"{run}.")
            for each in world.seen
        )
    )


async def warning(world: World) -> str:
    """Let the runs go on, and wait for the warning of a circle; its text."""
    control = world.executive.control
    events = control.subscribe()
    await control.signal(GO)
    async with asyncio.timeout(1):
        async for event in events:
            if isinstance(event, Alert) and event.code == "WAITING_CIRCLE":
                break
    assert NONE_GOES_ON in event.text
    assert not re.search(r"\br\d\.\w", event.text)
    return event.text


@pytest.mark.parametrize("out", ["stop", "take"])
@pytest.mark.parametrize("crossing", ["vehicle='one'", "requires=\"vehicle.name == 'one'\""])
def test_a_vehicle_kept_for_who_waits_for_space_closes_a_circle_with_who_has_the_space(
    play: Play, crossing: str, out: str
) -> None:
    async def story(world: World) -> str:
        control = world.executive.control
        holder = await control.start(holding_and_waiting("two", "one", *FOLLOW))
        await world.under_way(holder)
        crosser = await control.start(crosses(crossing))
        await waits(world, crosser)
        text = await warning(world)
        stop, take = re.findall(r"`m2pem stop (r\d)`\), or take (\w+), drive it out", text)[0]
        if out == "stop":
            await control.stop(stop)
            assert (await control.wait(holder)).status is RunStatus.TERMINATED
        else:
            await control.take(take, by="anna")
            assert (await control.wait(holder)).status is RunStatus.FAILED
            await control.give_back(take, by="anna")
            assert (await control.wait(crosser)).status is RunStatus.COMPLETED
        return text

    text = play_on_bridge(play, story)
    assert "Over of r2 (mission): one would enter bridge (capacity 1)" in text
    assert "which is taken by two, which does Hold of r1 (mission) (follow)" in text
    assert "Need of r1 (mission) waits for one (kept for Over of r2 (mission))" in text


def test_a_vehicle_that_a_run_keeps_at_rest_in_space_closes_a_circle(play: Play) -> None:
    async def story(world: World) -> str:
        control = world.executive.control
        for keeps, parameters, then in (
            ("one", given(target=at(50, 0)), task("Then", "vehicle='two' wait='unlimited'")),
            ("two", given(target=at(100, 10)), task("Then", "vehicle='two'", "goto", BACK)),
        ):
            keep = task("Keep", f"vehicle='{keeps}' keep='process'", "goto", parameters)
            rest = sequence(("Keep", keep), ("Q", CATCH), ("Then", then))
            run = await control.start(mission(f'<signal id="Sig" name="{GO}"/>{rest}'))
            await world.until(lambda run=run: world.ends(run))
        text = await warning(world)
        await control.stop(re.findall(r"`m2pem stop (r\d)`", text)[0])
        assert (await control.wait("r1")).status is RunStatus.COMPLETED
        return text

    text = play_on_bridge(play, story)
    assert "Then of r1 (mission) waits for two (held by Keep of r2 (mission), which" in text
    assert "Then of r2 (mission): two would enter bridge" in text
    assert "which is taken by one, which is at rest there" in text
