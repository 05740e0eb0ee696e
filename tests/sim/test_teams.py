import math

import pytest
from conftest import START_US, Simulate, area, local, place, route

from m2pem.api.telemetry import VehicleState
from m2pem.model.behavior import BehaviorType
from m2pem.model.catalogue import BehaviorState, ResourceId
from m2pem.model.geometry import Point, VehiclePosition
from m2pem.resources.behaviors import SHARED
from m2pem.sim.arbiters import SimArbiter
from m2pem.sim.teams import TEAM_MANOEUVRES
from m2pem.teams.shapes import slot
from m2pem.testing.contracts.bench import ArbiterBench

S = 1_000_000
NAMES = ("v1", "v2", "v3")
TEAM = {name: ("ground", {"heading": "90 deg"}) for name in NAMES}
ROAD = route((100, 0), (400, 0))


def ends(bench: ArbiterBench) -> list[tuple[float, float]]:
    found = []
    for name in NAMES:
        state = bench.latest(name)
        assert isinstance(state, VehicleState)
        found.append(local(state.position))
    return found


def test_every_shared_team_behavior_is_a_manoeuvre() -> None:
    shared = {name for name, type_ in SHARED if type_ is BehaviorType.TEAM}
    assert set(TEAM_MANOEUVRES) == shared


@pytest.mark.parametrize(
    "shape", ["column", "line", "wedge", "vee", "diamond", "echelon_left", "echelon_right"]
)
def test_no_two_members_share_a_slot(shape: str) -> None:
    slots = [slot(shape, index) for index in range(12)]
    assert len(set(slots)) == 12
    assert slots[0] == (0, 0)


@pytest.mark.parametrize(
    ("behavior", "expected"),
    [
        ("road_following_formation", [(400, 0), (390, 0), (380, 0)]),
        ("road_sweep", [(400, 0), (400, 10), (400, -10)]),
        ("formation", [(400, 0), (390, 10), (390, -10)]),
        ("bridge_crossing", [(400, 0), (390, 0), (380, 0)]),
    ],
)
def test_a_team_arrives_in_its_shape(
    simulate: Simulate, behavior: str, expected: list[tuple[float, float]]
) -> None:
    async def main(bench: ArbiterBench, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", behavior, *NAMES, route=ROAD, spacing=10.0)
        assert (await bench.ended("r1.b1", 3600)).state is BehaviorState.SUCCEEDED
        for found, wanted in zip(ends(bench), expected, strict=True):
            assert found == pytest.approx(wanted, abs=0.1)
        assert [effect.kind for effect in arbiter.effects] == ["start", "end"]

    simulate(TEAM, main)


def test_the_slowest_member_sets_the_speed(simulate: Simulate) -> None:
    fleet = {**TEAM, "v3": ("ground", {"max_speed": "2 m/s", "heading": "90 deg"})}

    async def main(bench: ArbiterBench, _: SimArbiter) -> None:
        await bench.start("r1.b1", "road_following_formation", *NAMES, route=ROAD, speed=8.0)
        await bench.ended("r1.b1", 3600)
        assert (bench.clock.now_us() - START_US) / S >= 400 / 2

    simulate(fleet, main)


def test_a_bridge_is_crossed_by_one_at_a_time(simulate: Simulate) -> None:
    async def main(bench: ArbiterBench, _: SimArbiter) -> None:
        await bench.start("r1.b1", "bridge_crossing", *NAMES, route=ROAD)
        await bench.ended("r1.b1", 3600)
        moving: dict[int, set[str]] = {}
        for state in bench.states:
            if isinstance(state, VehicleState) and state.velocity_enu_m_s != (0.0, 0.0, 0.0):
                moving.setdefault(state.time_us, set()).add(state.resource)
        assert moving
        assert all(len(names) == 1 for names in moving.values())

    simulate(TEAM, main, telemetry_hz=1.0)


def test_without_a_route_the_members_form_up_on_the_lead(simulate: Simulate) -> None:
    async def main(bench: ArbiterBench, _: SimArbiter) -> None:
        await bench.start("r1.b1", "formation", *NAMES, shape="line", spacing=12.0)
        await bench.ended("r1.b1", 3600)
        for found, wanted in zip(ends(bench), [(0, 0), (0, 12), (0, -12)], strict=True):
            assert found == pytest.approx(wanted, abs=0.1)

    simulate(TEAM, main)


def test_members_survey_an_area_together_in_less_time(simulate: Simulate) -> None:
    field = area((0, 0), (300, 0), (300, 150), (0, 150))

    async def main(bench: ArbiterBench, _: SimArbiter) -> None:
        await bench.start("r1.b1", "area_survey", "v1", area=field, spacing=25.0)
        await bench.ended("r1.b1", 3600)
        alone_us = bench.clock.now_us() - START_US
        await bench.start("r1.b2", "area_survey", *NAMES, area=field, spacing=25.0)
        await bench.ended("r1.b2", 3600)
        together_us = bench.clock.now_us() - START_US - alone_us
        assert together_us < 0.6 * alone_us

    simulate(TEAM, main)


def test_an_escort_surrounds_its_target_until_cancelled(simulate: Simulate) -> None:
    async def main(bench: ArbiterBench, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", "escort", *NAMES, target=VehiclePosition("vip"), spacing=20.0)
        await bench.start("r1.b2", "goto", "vip", target=Point(place(200, 0)))
        await bench.clock.sleep(300)
        assert bench.states_of("r1.b1") == ["ACCEPTED", "RUNNING"]
        for found in ends(bench):
            assert math.dist(found, (200, 0)) == pytest.approx(20, abs=0.5)
        await arbiter.cancel("r1.b1", 1)
        await bench.ended("r1.b1", 30)

    simulate({**TEAM, "vip": ("ground", {})}, main, telemetry_hz=1.0)


def test_holding_one_member_delays_the_end_of_all(simulate: Simulate) -> None:
    async def main(bench: ArbiterBench, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", "road_following_formation", *NAMES, route=ROAD)
        await bench.clock.sleep(20)
        await arbiter.hold(ResourceId("v2"))
        await bench.clock.sleep(500)
        assert bench.states_of("r1.b1") == ["ACCEPTED", "RUNNING"]
        await arbiter.resume(ResourceId("v2"))
        assert (await bench.ended("r1.b1", 100)).state is BehaviorState.SUCCEEDED

    simulate(TEAM, main)


def test_preempting_one_member_stops_the_others(simulate: Simulate) -> None:
    async def main(bench: ArbiterBench, _: SimArbiter) -> None:
        await bench.start("r1.b1", "road_following_formation", *NAMES, route=ROAD)
        await bench.clock.sleep(20)
        await bench.start("r1.b2", "reverse", "v2", preempts=("r1.b1",))
        assert (await bench.ended("r1.b1", 0.1)).state is BehaviorState.CANCELLED
        await bench.clock.sleep(60)
        for name in NAMES:
            state = bench.latest(name)
            assert isinstance(state, VehicleState)
            assert state.velocity_enu_m_s == (0.0, 0.0, 0.0)

    simulate(TEAM, main, telemetry_hz=1.0)
