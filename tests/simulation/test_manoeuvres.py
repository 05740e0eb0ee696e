import math

import pytest
from shapely import LineString, Polygon, union_all

from m2pem.api.telemetry import VehicleState
from m2pem.fleet.behaviors import FLOWN, SHARED
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.mission.geometry import Area, Point, Route, VehiclePosition
from m2pem.simulation.arbiters import SimArbiter
from m2pem.simulation.frame import FlatFrame
from m2pem.simulation.manoeuvres import MANOEUVRES
from m2pem.telemetry.bus import Bus
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness
from tests.simulation.conftest import (
    ORIGIN,
    START_US,
    Fleet,
    Simulate,
    area,
    local,
    place,
    position,
    route,
)

S = 1_000_000
UGV: Fleet = {"ugv": ("ground", {}), "lead": ("ground", {})}
UAV: Fleet = {"uav": ("air", {"endurance": "10 h"}), "lead": ("ground", {})}
ALOFT: Fleet = {"uav": ("air", {"endurance": "10 h", "altitude": "30 m"}), "lead": ("ground", {})}
SQUARE = area((0, 0), (200, 0), (200, 100), (0, 100))


def at(bench: ArbiterHarness, vehicle: str) -> tuple[float, float, float]:
    state = bench.latest(vehicle)
    assert isinstance(state, VehicleState)
    assert state.altitude_above_home_m is not None
    return (*local(state.position), state.altitude_above_home_m)


def metres(drawn: Area) -> list[tuple[float, float]]:
    return [FlatFrame(ORIGIN).to_place(corner[:2]) for corner in drawn.rings[0]]


def heading(bench: ArbiterHarness, vehicle: str) -> float:
    state = bench.latest(vehicle)
    assert isinstance(state, VehicleState)
    assert state.yaw_rad is not None
    return math.pi / 2 - state.yaw_rad


def tracks(bench: ArbiterHarness, vehicle: str) -> list[tuple[float, float, float]]:
    return [
        (*local(state.position), state.altitude_above_home_m or 0.0)
        for state in bench.states
        if isinstance(state, VehicleState) and state.resource == vehicle
    ]


async def do(
    bench: ArbiterHarness, id_: str, behavior: str, vehicle: str, **wishes: object
) -> float:
    began_us = bench.clock.now_us()
    await bench.start(id_, behavior, vehicle, **wishes)  # type: ignore[arg-type]
    end = await bench.ended(id_, 36_000)
    assert end.state is BehaviorState.SUCCEEDED, end
    return (bench.clock.now_us() - began_us) / S


def test_every_shared_vehicle_behavior_is_a_manoeuvre() -> None:
    shared = {name for name, type_ in SHARED if type_ is BehaviorType.VEHICLE}
    assert set(MANOEUVRES) == shared


FLOWN_PARAMETERS: dict[str, dict[str, object]] = {
    "single_vehicle_routing": {"route": route((50, 0, 40), (90, 0, 50))},
    "goto": {"target": Point(place(50, 0, 40))},
    "change_altitude": {"altitude": 20.0},
    "area_survey": {"area": SQUARE, "altitude": 30.0},
    "orbit": {"target": Point(place(50, 0)), "altitude": 30.0},
    "area_observe": {"area": SQUARE, "duration": 5.0, "altitude": 30.0},
    "follow": {"target": VehiclePosition("lead"), "altitude": 30.0},
}


@pytest.mark.parametrize("behavior", sorted(FLOWN))
def test_an_aircraft_on_the_ground_refuses_what_must_fly(simulate: Simulate, behavior: str) -> None:
    wishes = FLOWN_PARAMETERS[behavior]

    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", behavior, "uav", **wishes)  # type: ignore[arg-type]
        end = await bench.ended("r1.b1", 10)
        assert end.state is BehaviorState.REJECTED
        assert end.reason == "uav is on the ground: take off first (takeoff)"
        await do(bench, "r1.b2", "takeoff", "uav", altitude=20.0)
        await bench.start("r1.b3", behavior, "uav", **wishes)  # type: ignore[arg-type]
        assert await bench.until(lambda: "RUNNING" in bench.states_of("r1.b3"), 10)
        await arbiter.cancel("r1.b3", 1)
        await bench.ended("r1.b3", 10)
        await do(bench, "r1.b4", "land", "uav")
        await bench.start("r1.b5", behavior, "uav", **wishes)  # type: ignore[arg-type]
        assert (await bench.ended("r1.b5", 10)).state is BehaviorState.REJECTED

    simulate(UAV, main)


def test_an_aircraft_away_from_home_on_the_ground_does_not_return(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await do(bench, "r1.b0", "return_to_launch", "uav")
        await do(bench, "r1.b1", "takeoff", "uav", altitude=20.0)
        await do(bench, "r1.b2", "goto", "uav", target=Point(place(50, 0)))
        await do(bench, "r1.b3", "land", "uav")
        await bench.start("r1.b4", "return_to_launch", "uav")
        assert "take off first" in (await bench.ended("r1.b4", 10)).reason

    simulate(UAV, main)


def test_an_aircraft_may_begin_in_the_air(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await do(bench, "r1.b0", "hold", "uav", duration=2.0)
        assert at(bench, "uav") == pytest.approx((0, 0, 30))
        await do(bench, "r1.b1", "goto", "uav", target=Point(place(50, 0)))
        assert at(bench, "uav") == pytest.approx((50, 0, 30), abs=0.01)
        await do(bench, "r1.b2", "return_to_launch", "uav")
        assert at(bench, "uav") == pytest.approx((0, 0, 0), abs=0.01)

    simulate(ALOFT, main)


def test_a_rover_has_no_altitude_at_first(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await do(bench, "r1.b0", "hold", "ugv", duration=2.0)
        assert at(bench, "ugv") == pytest.approx((0, 0, 0))

    simulate({"ugv": ("ground", {"altitude": "30 m"})}, main)


def test_altitudes_are_read_in_their_frame(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await do(bench, "r1.b1", "takeoff", "uav", altitude=100.0, altitude_frame="amsl")
        assert at(bench, "uav")[2] == pytest.approx(40.0)
        await do(bench, "r1.b2", "change_altitude", "uav", altitude=25.0)
        assert at(bench, "uav")[2] == pytest.approx(25.0)
        target = Point(place(0, 0, 80), "amsl")
        await do(bench, "r1.b3", "goto", "uav", target=target)
        assert at(bench, "uav")[2] == pytest.approx(20.0)

    simulate(UAV, main)


def test_waypoints_of_a_route_are_passed_in_their_own_frames(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await do(bench, "r1.b1", "takeoff", "uav", altitude=20.0)
        there, back = place(0, 100, 85), place(0, 0, 30)  # home is 60 m above the sea
        for number, way, up in (
            (2, Route.of((back, there), ("relative", "amsl")), 25.0),
            (3, Route.of((there, back), ("amsl", "relative")), 30.0),
        ):
            await do(bench, f"r1.b{number}", "single_vehicle_routing", "uav", route=way)
            assert at(bench, "uav")[2] == pytest.approx(up)

    simulate(UAV, main)


def test_a_ground_vehicle_stays_on_the_ground(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await do(bench, "r1.b1", "goto", "ugv", target=Point(place(50, 0, 90)), altitude=30.0)
        assert at(bench, "ugv") == pytest.approx((50, 0, 0), abs=0.01)

    simulate(UGV, main)


def test_goto_ends_with_the_wished_heading(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        target = Point(place(50, 0))
        await do(bench, "r1.b1", "goto", "ugv", target=target, heading=math.pi)
        assert math.remainder(heading(bench, "ugv") - math.pi, math.tau) == pytest.approx(0)

    simulate(UGV, main)


def test_a_loop_passes_its_route_again_and_again(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start(
            "r1.b1",
            "single_vehicle_routing",
            "ugv",
            route=route((0, 0), (100, 0), (100, 100)),
            loop=True,
        )
        await bench.clock.sleep(600)
        visits = 0
        before = math.inf
        for east, north, _ in tracks(bench, "ugv"):
            distance = math.dist((east, north), (100, 100))
            visits += distance < 5 <= before
            before = distance
        assert visits >= 5
        await arbiter.cancel("r1.b1", 1)
        await bench.ended("r1.b1", 10)

    simulate(UGV, main, telemetry_hz=2.0)


def test_hold_ends_when_the_vehicle_stands_or_after_its_duration(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        assert await do(bench, "r1.b1", "hold", "ugv") == pytest.approx(0)
        assert await do(bench, "r1.b2", "hold", "ugv", duration=30.0) == pytest.approx(30)

    simulate(UGV, main)


def test_reverse_goes_five_metres_back_unless_told(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await do(bench, "r1.b1", "reverse", "ugv")
        assert at(bench, "ugv") == pytest.approx((0, -5, 0), abs=0.01)
        await do(bench, "r1.b2", "reverse", "ugv", distance=12.0, speed=1.0)
        assert at(bench, "ugv") == pytest.approx((0, -17, 0), abs=0.01)

    simulate(UGV, main)


def test_an_aircraft_returns_high_and_lands_where_it_started(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await do(bench, "r1.b1", "goto", "uav", target=Point(place(100, 50, 10)))
        await do(bench, "r1.b2", "return_to_launch", "uav")
        assert at(bench, "uav") == pytest.approx((0, 0, 0), abs=0.01)
        flown = tracks(bench, "uav")
        assert all(height > 29 for east, _, height in flown[len(flown) // 2 :] if 10 < east < 90)
        state = bench.latest("uav")
        assert isinstance(state, VehicleState)
        assert state.mode == "landed"

    simulate(ALOFT, main, telemetry_hz=2.0)


def test_land_comes_down_where_it_is(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await do(bench, "r1.b1", "goto", "uav", target=Point(place(40, 0, 30)))
        await do(bench, "r1.b2", "land", "uav")
        assert at(bench, "uav") == pytest.approx((40, 0, 0), abs=0.01)

    simulate(ALOFT, main)


def test_a_survey_passes_every_part_of_the_area(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await do(bench, "r1.b1", "area_survey", "ugv", area=SQUARE, spacing=25.0)
        driven = [(east, north) for east, north, _ in tracks(bench, "ugv")]
        for east in range(5, 200, 10):
            for north in range(5, 100, 10):
                nearest = min(math.dist((east, north), p) for p in driven)
                assert nearest <= 12.5 + 1.0, (east, north)

    simulate(UGV, main, telemetry_hz=5.0)


def test_the_heading_of_a_survey_is_that_of_its_passes(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        along_s = await do(bench, "r1.b1", "area_survey", "ugv", area=SQUARE, spacing=20.0)
        across_s = await do(
            bench, "r1.b2", "area_survey", "ugv", area=SQUARE, spacing=20.0, heading=0.0
        )
        assert across_s > along_s * 1.3
        assert heading(bench, "ugv") % math.pi == pytest.approx(0, abs=1e-6)

    simulate(UGV, main)


def test_an_orbit_keeps_its_radius_for_its_turns(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        target = Point(place(100, 0))
        await do(bench, "r1.b0", "goto", "uav", target=Point(place(60, 0, 30)))
        before = len(bench.states)
        seconds = await do(
            bench, "r1.b1", "orbit", "uav", target=target, radius=40.0, turns=2.0, speed=8.0
        )
        radii = [
            math.dist(local(state.position), (100, 0))
            for state in bench.states[before:]
            if isinstance(state, VehicleState) and state.resource == "uav"
        ]
        assert max(abs(radius - 40) for radius in radii) < 0.1
        turning_s = math.pi
        assert seconds == pytest.approx(2 * math.tau * 40 / 8 + 8 / 3 + turning_s, rel=0.1)

    simulate(ALOFT, main, telemetry_hz=5.0)


def test_the_duration_of_an_orbit_counts_from_arriving_on_it(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        target = Point(place(100, 0))
        await do(bench, "r1.b0", "orbit", "uav", target=target, turns=0.0)
        seconds = await do(bench, "r1.b1", "orbit", "uav", target=target, duration=120.0)
        assert seconds == pytest.approx(120.0, abs=4)

    simulate(ALOFT, main)


@pytest.mark.parametrize("fleet", [UGV, ALOFT])
def test_observing_lasts_until_cancelled_or_for_its_duration(
    simulate: Simulate, fleet: Fleet
) -> None:
    vehicle = next(iter(fleet))

    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", "area_observe", vehicle, area=SQUARE)
        await bench.clock.sleep(5000)
        assert bench.states_of("r1.b1") == ["ACCEPTED", "RUNNING"]
        await arbiter.cancel("r1.b1", 1)
        assert (await bench.ended("r1.b1", 30)).state is BehaviorState.CANCELLED
        there_s = await do(bench, "r1.b2", "area_observe", vehicle, area=SQUARE, duration=0.0)
        seconds = await do(bench, "r1.b3", "area_observe", vehicle, area=SQUARE, duration=90.0)
        assert seconds == pytest.approx(90.0, abs=10)
        assert there_s < 60

    simulate(fleet, main)


def test_a_ground_vehicle_observes_from_the_edge_with_the_area_before_it(
    simulate: Simulate,
) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        field = area((-50, 80), (50, 80), (50, 180), (-50, 180))
        await do(bench, "r1.b1", "area_observe", "ugv", area=field, duration=1.0)
        assert at(bench, "ugv") == pytest.approx((0, 80, 0), abs=0.05)
        assert heading(bench, "ugv") == pytest.approx(0, abs=0.01)

    simulate(UGV, main)


def test_set_speed_is_the_speed_of_what_follows(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        there, back = Point(place(0, 500)), Point(place(0, 0))
        usual_s = await do(bench, "r1.b1", "goto", "ugv", target=there)
        assert await do(bench, "r1.b2", "set_speed", "ugv", speed=10.0) == pytest.approx(0)
        faster_s = await do(bench, "r1.b3", "goto", "ugv", target=back)
        assert usual_s == pytest.approx(500 / 5 + 2.5, abs=0.1)
        assert faster_s == pytest.approx(500 / 10 + 5 + math.pi / 0.5, abs=0.1)

    simulate(UGV, main)


def test_waypoints_have_speeds_unless_the_task_has_one(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        waypoints = tuple(place(0, north) for north in (100, 300, 500))
        with_speeds = Route(waypoints, speeds_m_s=(2.0, 10.0, None))
        slow_s = await do(bench, "r1.b1", "single_vehicle_routing", "ugv", route=with_speeds)
        # 100 m at the usual 5 m/s, 200 m at 2, 200 m at 10; the ramps between take 4 s at most.
        assert slow_s == pytest.approx(20 + 100 + 20, abs=6)
        await do(bench, "r1.b2", "goto", "ugv", target=Point(place(0, 0)))
        usual_s = await do(
            bench, "r1.b3", "single_vehicle_routing", "ugv", route=with_speeds, speed=5.0
        )
        assert usual_s == pytest.approx(500 / 5 + math.pi / 0.5, abs=4)

    simulate(UGV, main)


def test_a_loop_keeps_the_speeds_of_its_waypoints(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        corners = (place(0, 0), place(200, 0), place(200, 200))
        route = Route(corners, speeds_m_s=(None, 2.0, 8.0))
        await bench.start("r1.b1", "single_vehicle_routing", "ugv", route=route, loop=True)
        await bench.clock.sleep(600.0)
        fastest = {"first": 0.0, "second": 0.0, "third": 0.0}
        for state in bench.states:
            if not isinstance(state, VehicleState) or not state.velocity_enu_m_s:
                continue
            east, north = local(state.position)
            leg = "first" if abs(north) < 1 else "second" if abs(east - 200) < 1 else "third"
            speed = math.hypot(*state.velocity_enu_m_s)
            fastest[leg] = max(fastest[leg], speed)
        assert 1.9 < fastest["second"] < 5.1
        assert fastest["third"] == pytest.approx(8.0)
        assert fastest["first"] < 8.0

    simulate(UGV, main, telemetry_hz=5.0)


def test_a_wished_speed_beyond_the_vehicles_own_is_its_own(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await do(bench, "r1.b1", "goto", "ugv", target=Point(place(0, 500)), speed=99.0)
        speeds = [
            math.hypot(*state.velocity_enu_m_s)
            for state in bench.states
            if isinstance(state, VehicleState) and state.velocity_enu_m_s
        ]
        assert max(speeds) == pytest.approx(15.0)

    simulate(UGV, main, telemetry_hz=5.0)


def test_teleop_lasts_for_its_timeout(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        assert await do(bench, "r1.b1", "teleop", "ugv", timeout=45.0) == pytest.approx(45)

    simulate(UGV, main)


@pytest.mark.parametrize("fleet", [UGV, ALOFT])
def test_following_keeps_its_station_while_the_target_moves_and_stands(
    simulate: Simulate, fleet: Fleet
) -> None:
    follower = next(iter(fleet))

    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", "follow", follower, target=VehiclePosition("lead"), offset=20.0)
        await bench.start(
            "r1.b2", "single_vehicle_routing", "lead", route=route((0, 300), (300, 300))
        )
        await bench.clock.sleep(50)
        assert math.dist(at(bench, follower)[:2], at(bench, "lead")[:2]) == pytest.approx(20, abs=8)
        await bench.ended("r1.b2", 1000)
        await bench.clock.sleep(60)
        east, north, height = at(bench, follower)
        assert (east, north) == pytest.approx((280, 300), abs=0.5)
        assert height == pytest.approx(30.0 if follower == "uav" else 0.0, abs=0.5)
        await arbiter.cancel("r1.b1", 1)
        assert (await bench.ended("r1.b1", 10)).state is BehaviorState.CANCELLED

    simulate(fleet, main, telemetry_hz=2.0)


def test_a_held_follower_stands_and_catches_up_when_resumed(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", "follow", "ugv", target=VehiclePosition("lead"))
        await bench.start("r1.b2", "goto", "lead", target=Point(place(0, 400)))
        await bench.clock.sleep(40)
        await arbiter.hold(ResourceId("ugv"))
        await bench.clock.sleep(10)
        stood = at(bench, "ugv")
        await bench.clock.sleep(200)
        assert at(bench, "ugv") == stood
        await arbiter.resume(ResourceId("ugv"))
        await bench.clock.sleep(200)
        assert at(bench, "ugv")[:2] == pytest.approx((0, 385), abs=0.5)

    simulate(UGV, main, telemetry_hz=2.0)


def test_a_target_elsewhere_is_followed_as_it_is_heard_on_the_bus(simulate: Simulate) -> None:
    bus = Bus()

    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        bus.publish(VehicleState(ResourceId("stranger"), START_US, position(200, 0), yaw_rad=0.0))
        await bench.start("r1.b1", "follow", "ugv", target=VehiclePosition("stranger"), offset=10.0)
        await bench.clock.sleep(120)
        assert at(bench, "ugv")[:2] == pytest.approx((190, 0), abs=0.5)

    simulate(UGV, main, bus=bus)


def test_a_survey_leads_around_the_holes_of_its_area_and_sees_what_is_beside_them(
    simulate: Simulate,
) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        holes = [area((12, 8), (190, 8), (190, 44), (12, 44)), area((2, 60), (100, 60), (2, 97))]
        both = Area((*SQUARE.rings, *(each.rings[0] for each in holes)))
        await do(bench, "r1.b0", "goto", "ugv", target=Point(place(100, 52, 0)))
        before = len(tracks(bench, "ugv"))
        await do(bench, "r1.b1", "area_survey", "ugv", area=both, spacing=30.0, heading=1.57079633)
        driven = LineString([each[:2] for each in tracks(bench, "ugv")[before - 1 :]])
        kept_out = union_all([Polygon(metres(each)) for each in holes])
        # Corners are driven in arcs, which cut them by less than this.
        assert driven.intersection(kept_out.buffer(-0.3)).length == 0.0
        seen = driven.buffer(15.1)
        assert Polygon(metres(SQUARE)).difference(kept_out).difference(seen).buffer(-0.05).is_empty

    simulate(UGV, main, telemetry_hz=50.0)


def test_a_vehicle_begins_at_home_and_altitudes_count_from_there(simulate: Simulate) -> None:
    latitude, longitude, _ = place(70, -30)
    home = {"home": [latitude, longitude, 90.0], "heading": "180 deg"}

    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await do(bench, "r1.b1", "takeoff", "uav", altitude=12.0)
        state = bench.latest("uav")
        assert isinstance(state, VehicleState)
        assert state.position is not None
        assert local(state.position) == pytest.approx((70, -30), abs=0.01)
        assert state.position.altitude_m == pytest.approx(102.0)
        assert state.altitude_above_home_m == pytest.approx(12.0)
        assert math.remainder(heading(bench, "uav") - math.pi, math.tau) == pytest.approx(0)

    simulate({"uav": ("air", home)}, main)


def test_goto_a_vehicle_goes_to_where_it_is_at_the_start(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await do(bench, "r1.b1", "goto", "lead", target=Point(place(90, 0)))
        await do(bench, "r1.b2", "goto", "uav", target=VehiclePosition("lead"), altitude=15.0)
        assert at(bench, "uav") == pytest.approx((90, 0, 15), abs=0.01)
        await do(bench, "r1.b3", "goto", "lead", target=VehiclePosition("uav"))
        assert at(bench, "lead") == pytest.approx((90, 0, 0), abs=0.01)

    simulate(ALOFT, main)
