"""Team behaviors to their ends, on arbiters that know nothing of teams."""

import asyncio
import math
from collections import Counter
from itertools import pairwise
from typing import Any

import pytest

from m2pem.api.runs import RunStatus
from m2pem.api.telemetry import TeamState, VehicleState
from m2pem.engine.records import BehaviorProgressed
from m2pem.fleet.fleet import Domain
from m2pem.mission.catalogue import BehaviorState, ResourceId

from .carts import FRAME, Yard
from .conftest import Play, World, area, one_task, route

BRIDGE = {"bridge": route((50, 0), (150, 0))}
FIELD = {"field": area((0, 0), (200, 0), (200, 100), (0, 100))}
ARBITERS = pytest.mark.parametrize("arbiter", ["carts", "willing", "sim"])


def places(world: World) -> dict[str, tuple[float, float]]:
    """Where the vehicles are, by what they say."""
    found = {}
    for name in world.executive.fleet.vehicles:
        state = world.executive.bus.latest(name)
        assert isinstance(state, VehicleState)
        assert state.position is not None
        found[str(name)] = FRAME.to_local(
            (state.position.latitude_deg, state.position.longitude_deg)
        )
    return found


def moving(world: World) -> set[str]:
    """Who moves, by what they say."""
    found = set()
    for name in world.executive.fleet.vehicles:
        state = world.executive.bus.latest(name)
        if isinstance(state, VehicleState) and math.hypot(*(state.velocity_enu_m_s or (0.0,))) > 0:
            found.add(str(name))
    return found


async def done(world: World, mission: bytes) -> dict[str, tuple[float, float]]:
    """Run a mission to its good end; where the vehicles are then."""
    run = await world.executive.control.start(mission)
    summary = await world.executive.control.wait(run)
    assert summary.status is RunStatus.COMPLETED, world.seen
    (ended,) = world.ended()
    assert ended.state is BehaviorState.SUCCEEDED
    return places(world)


@ARBITERS
def test_a_bridge_is_crossed_by_one_at_a_time_and_the_column_stands_again(
    play: Play, arbiter: str
) -> None:
    async def story(world: World) -> Any:
        run = await world.executive.control.start(
            one_task("bridge_crossing", route="bridge", spacing="10 m")
        )
        crowds: list[set[str]] = []
        while not world.ended():
            crowds.append(moving(world))
            await world.clock.sleep(0.2)
        await world.executive.control.wait(run)
        return crowds, places(world), world.seen

    yard = Yard(a=(0, 0), b=(-10, 0), c=(-20, 0))
    crowds, ends, seen = play(story, yard, arbiter=arbiter, geometries=BRIDGE)
    assert max(len(crowd) for crowd in crowds) == 1
    assert [*dict.fromkeys(name for crowd in crowds for name in crowd)] == ["a", "b", "c"]
    for name, place in {"a": (150, 0), "b": (140, 0), "c": (130, 0)}.items():
        assert math.dist(ends[name], place) < 0.5
    states = [each.state for each in seen if isinstance(each, BehaviorProgressed)]
    assert states[0] is BehaviorState.ACCEPTED
    assert set(states[1:]) == {BehaviorState.RUNNING}


@ARBITERS
def test_without_a_route_the_members_form_up_on_the_lead(play: Play, arbiter: str) -> None:
    async def story(world: World) -> Any:
        await world.clock.sleep(1)
        lead = world.executive.bus.latest(ResourceId("a"))
        found = await done(world, one_task("formation", shape="line", spacing="12 m"))
        return lead, found

    yard = Yard(a=(0, 0), b=(-30, 4), c=(-60, 0))
    lead, found = play(story, yard, arbiter=arbiter)
    east, north = found["a"]
    left = lead.yaw_rad + math.pi / 2
    for name, side in (("b", 12), ("c", -12)):
        wanted = east + side * math.cos(left), north + side * math.sin(left)
        assert math.dist(found[name], wanted) < 0.5


def rows(trail: list[tuple[float, float]]) -> set[int]:
    """The rows that were driven, by their metres north."""
    counts = Counter(round(north) for east, north in trail if 20 < east < 180)
    return {north for north, count in counts.items() if count > 100}


@pytest.mark.parametrize(
    "arbiter", ["carts", pytest.param("willing", marks=pytest.mark.long), "sim"]
)
def test_members_cover_an_area_together_each_its_own_band(play: Play, arbiter: str) -> None:
    async def story(world: World) -> Any:
        trails: dict[str, list[tuple[float, float]]] = {}
        run = await world.executive.control.start(
            one_task("area_survey", area="field", spacing="10 m")
        )
        while not world.ended():
            for name, place in places(world).items():
                trails.setdefault(name, []).append(place)
            await world.clock.sleep(0.2)
        summary = await world.executive.control.wait(run)
        assert summary.status is RunStatus.COMPLETED, world.seen
        return trails

    yard = Yard(a=(-10, 20), b=(-10, 50), c=(-10, 80))
    trails = play(story, yard, arbiter=arbiter, geometries=FIELD)
    for east in range(10, 200, 10):
        for north in range(5, 100, 10):
            near = [
                name
                for name, trail in trails.items()
                if min(math.dist((east, north), place) for place in trail) < 5.5
            ]
            assert near, (east, north)
    for one, two in pairwise("abc"):
        low, high = (rows(trails[name]) for name in (one, two))
        assert max(low) < min(high), "the lanes lie beside each other"


@ARBITERS
def test_members_observe_an_area_from_around_it_for_the_duration(play: Play, arbiter: str) -> None:
    async def story(world: World) -> Any:
        before_us = world.clock.now_us()
        found = await done(world, one_task("area_observe", area="field", duration="60 s"))
        return found, (world.clock.now_us() - before_us) / 1e6

    yard = Yard(a=(250, 50), b=(100, 150), c=(-40, 50))
    found, took_s = play(story, yard, arbiter=arbiter, geometries=FIELD)
    assert took_s > 60
    for index, name in enumerate("abc"):
        angle = math.tau * index / 3
        offset = found[name][0] - 100, found[name][1] - 50
        assert math.remainder(math.atan2(offset[1], offset[0]) - angle, math.tau) < 0.05
        on_edge = min(abs(abs(offset[0]) - 100), abs(abs(offset[1]) - 50))
        assert on_edge < 1.0, "each stands at the edge"


@pytest.mark.parametrize("arbiter", [pytest.param("carts", marks=pytest.mark.long), "sim"])
def test_an_escort_stays_around_its_target_until_it_is_stopped(play: Play, arbiter: str) -> None:
    async def story(world: World) -> Any:
        run = await world.executive.control.start(one_task("escort", target="vip", spacing="20 m"))
        await world.clock.sleep(200)
        around = places(world)
        assert not world.ended()
        await world.executive.control.stop(run)
        await world.executive.control.wait(run)
        return around, world.ended()

    yard = Yard(a=(-10, 0), b=(-20, 0), c=(-30, 0), vip=(40, 0))
    around, ended = play(story, yard, arbiter=arbiter, others=("vip",))
    for name in "abc":
        assert math.dist(around[name], around["vip"]) == pytest.approx(20, abs=1)
    for one, two in pairwise("abc"):
        assert math.dist(around[one], around[two]) > 30
    assert [each.state for each in ended] == [BehaviorState.CANCELLED]


@pytest.mark.parametrize(
    "arbiters",
    [
        ("carts", "willing", "sim"),
        pytest.param(("sim", "carts", "willing"), marks=pytest.mark.long),
    ],
)
def test_members_of_different_arbiters_and_domains_march_as_one(
    play: Play, arbiters: tuple[str, ...]
) -> None:
    async def story(world: World) -> Any:
        run = await world.executive.control.start(
            one_task("road_following_formation", route="road", spacing="30 m", speed="4 m/s")
        )
        gaps = []
        while not world.ended():
            at = places(world)
            if at["c"][0] > 50:
                gaps += [at["a"][0] - at["b"][0], at["b"][0] - at["c"][0]]
            await world.clock.sleep(0.5)
        summary = await world.executive.control.wait(run)
        assert summary.status is RunStatus.COMPLETED, world.seen
        return gaps, places(world)

    # The simulated one begins where the fleet's origin puts it.
    yard = Yard(a=(0, 0), b=(-10, 0), c=(-20, 0))
    gaps, ends = play(
        story,
        yard,
        arbiter=dict(zip("abc", arbiters, strict=True)),
        domains={"b": Domain.AIR},
        geometries={"road": route((50, 0), (400, 0))},
    )
    assert min(gaps) > 15
    for name, place in {"a": (400, 0), "b": (370, 0), "c": (340, 0)}.items():
        assert math.dist(ends[name], place) < 1.0


def test_how_well_a_march_keeps_its_places_is_told_while_it_lasts(play: Play) -> None:
    async def story(world: World) -> Any:
        told: list[TeamState] = []
        states = world.executive.control.telemetry(10_000)

        async def listen() -> None:
            async for state in states:
                if isinstance(state, TeamState):
                    told.append(state)

        listening = asyncio.create_task(listen())
        await done(world, one_task("road_following_formation", route="bridge", spacing="20 m"))
        await world.clock.sleep(1)
        count = len(told)
        await world.clock.sleep(20)
        listening.cancel()
        assert len(told) == count, "nobody marches any more"
        return told

    yard = Yard(a=(0, 0), b=(-20, 0), c=(-60, 0))
    told = play(story, yard, geometries=BRIDGE)
    assert {(each.behavior, each.name, each.spacing_m) for each in told} == {
        ("r1.b1", "road_following_formation", 20.0)
    }
    assert [each.resource for each in told[0].members] == ["a", "b", "c"]
    assert told[0].members[2].along_m == pytest.approx(-20.0, abs=2)
    assert told[-1].members[2].along_m == pytest.approx(0.0, abs=2)
    between = [(b.time_us - a.time_us) / 1e6 for a, b in pairwise(told)]
    assert min(between) >= 0.2, "at most five times a second"
