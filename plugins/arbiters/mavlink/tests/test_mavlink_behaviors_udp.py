"""Behaviors on simulated autopilots, over real UDP: judged by where the vehicles really are."""

import asyncio
import math
import statistics
from contextlib import asynccontextmanager
from itertools import count, pairwise

import pytest
from m2pem_plugin_mavlink.simulator.specification import Kind
from mavlink_ground import Ground
from mavlink_simulated import AMPLE_S, at, fly
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import (
    Area,
    BehaviorState,
    Point,
    Route,
    VehiclePosition,
    VehicleState,
)

COPTER, ROVER = Kind.COPTER, Kind.ROVER
DO_SET_MODE, LAND_MODE, MANUAL_MODE, ACCEPTED = 176, 9, 0, 0


def point(east: float, north: float, altitude: float | None = None, frame="relative") -> Point:
    return Point((*at(east, north), altitude), frame)


def test_a_copter_takes_off_goes_climbs_and_returns() -> None:
    async def main(bench) -> None:
        await bench.do("r1.b1", "takeoff", altitude=10.0)
        assert bench.truth().up_m == pytest.approx(10.0, abs=1.0)
        await bench.do("r1.b2", "goto", target=point(40, 30, 15.0), speed=6.0)
        assert bench.level() == pytest.approx((40, 30), abs=2.5)
        assert bench.truth().up_m == pytest.approx(15.0, abs=2.0)
        await bench.do("r1.b3", "change_altitude", altitude=513.0, altitude_frame="amsl")
        assert bench.truth().up_m == pytest.approx(25.0, abs=1.1)
        await bench.do("r1.b4", "return_to_launch")
        assert not bench.truth().armed
        assert bench.level() == pytest.approx((0, 0), abs=2.0)
        assert bench.truth().up_m == pytest.approx(0.0, abs=0.3)

    fly(main, COPTER)


def test_a_copter_lands_where_it_is() -> None:
    async def main(bench) -> None:
        await bench.do("r1.b1", "takeoff", altitude=6.0)
        await bench.do("r1.b2", "hold", duration=3.0)
        await bench.do("r1.b3", "land")
        assert not bench.truth().armed

    fly(main, COPTER)


def test_a_rover_drives_backs_up_stops_and_returns() -> None:
    async def main(bench) -> None:
        await bench.do("r1.b1", "goto", target=point(30, 0))
        before = bench.level()
        assert before == pytest.approx((30, 0), abs=2.6)
        await bench.do("r1.b2", "reverse", distance=8.0, speed=1.0)
        assert math.dist(bench.level(), before) == pytest.approx(8.0, abs=1.5)
        assert bench.level()[0] < before[0]
        await bench.do("r1.b3", "drive_stop")
        await bench.do("r1.b4", "return_to_launch")
        assert bench.level() == pytest.approx((0, 0), abs=5.0)

    fly(main, ROVER)


def test_a_copter_follows_a_rover() -> None:
    async def main(bench) -> None:
        def tell(state) -> None:
            if isinstance(state, VehicleState):
                bench.bus.publish(state)

        await bench.do("r1.b1", "takeoff", altitude=8.0)
        await bench.start("r1.b2", "goto", "v2", target=point(120, 20), speed=3.0)
        await bench.running("r1.b2")
        begun = len(bench.states)

        async def hear() -> None:
            nonlocal begun
            for state in bench.states[begun:]:
                tell(state)
            begun = len(bench.states)
            await bench.clock.sleep(0.2)

        for _ in range(3):
            await hear()
        await bench.start(
            "r1.b3", "follow", "v1", target=VehiclePosition("v2"), offset=6.0, altitude=8.0
        )
        near = 0
        async with asyncio.timeout(40):
            while near < 50:
                await hear()
                distance_to_m = math.dist(bench.level(1), bench.level(2))
                near = near + 1 if abs(distance_to_m - 6.0) < 4.0 else 0
        assert bench.states_of("r1.b3")[-1] is BehaviorState.RUNNING
        end = await bench.ended("r1.b3", AMPLE_S)
        assert "v2 has sent no position" in end.reason

    # Slower than the others: a position is too old after 3 s, which a busy machine soon takes.
    fly(main, COPTER, ROVER, speed=5.0)


def test_an_actuator_is_worked() -> None:
    async def main(bench) -> None:
        await bench.do("r1.b1", "deploy", actuator="servo 9", value=1700.0)
        kinds = [event.kind for event in bench.truth().autopilot.log.events]
        assert "servo" in kinds

    fly(main, COPTER)


def route(*places: tuple[float, float], altitude: float = 15.0) -> Route:
    return Route(tuple((*at(*place), altitude) for place in places))


def field(east: float, north: float, side: float) -> Area:
    corners = [(0, 0), (side, 0), (side, side), (0, side), (0, 0)]
    return Area((tuple((*at(east + e, north + n), None) for e, n in corners),))


class Track:
    """Where a vehicle really is, over and over, until it is told to stop."""

    def __init__(self, bench, number: int = 1) -> None:
        self.bench, self.number, self.places, self.times_s = bench, number, [], []

    async def __aenter__(self):
        self._task = asyncio.create_task(self._look())
        return self

    async def __aexit__(self, *_) -> None:
        self._task.cancel()

    async def _look(self) -> None:
        while True:
            self.places.append(self.bench.level(self.number))
            self.times_s.append(self.bench.truth(self.number).autopilot.now_s)
            await self.bench.clock.sleep(0.2)

    def nearest_m(self, place: tuple[float, float]) -> float:
        """How near it came; between two looks it went straight, however late the second was."""
        return min(distance_to_m(place, *ends) for ends in pairwise(self.places))

    def speeds_m_s(self) -> list[float]:
        """Its mean speed between two looks, by its own time."""
        looks = zip(self.times_s, self.places, strict=True)
        return [
            math.dist(a, b) / (after_s - before_s)
            for (before_s, a), (after_s, b) in pairwise(looks)
            if after_s > before_s
        ]


def distance_to_m(
    place: tuple[float, float], begin: tuple[float, float], end: tuple[float, float]
) -> float:
    """How far a place is from a straight line."""
    way = (end[0] - begin[0], end[1] - begin[1])
    length2 = way[0] ** 2 + way[1] ** 2
    along = (place[0] - begin[0]) * way[0] + (place[1] - begin[1]) * way[1]
    share = max(0.0, min(1.0, along / length2)) if length2 else 0.0
    return math.dist(place, (begin[0] + share * way[0], begin[1] + share * way[1]))


def test_a_copter_flies_a_route_in_its_order_and_at_its_speed() -> None:
    async def main(bench) -> None:
        await bench.do("r1.b1", "takeoff", altitude=15.0)
        async with Track(bench) as track:
            places = [(40, 0), (40, 40), (0, 40)]
            began_us = bench.clock.now_us()
            await bench.do("r1.b2", "single_vehicle_routing", route=route(*places), speed=4.0)
            took_s = (bench.clock.now_us() - began_us) / 1e6
        assert all(track.nearest_m(place) < 2.5 for place in places)
        assert bench.level() == pytest.approx((0, 40), abs=2.5)
        assert took_s > 120 / 4.0
        assert 3.5 < statistics.median(track.speeds_m_s()) < 4.5
        assert bench.truth().missions_begun == 1

    fly(main, COPTER)


def test_a_route_goes_on_after_a_hold() -> None:
    async def main(bench) -> None:
        await bench.start(
            "r1.b1", "single_vehicle_routing", "v1", route=route((80, 0), (80, 25)), speed=3.0
        )
        await bench.until(lambda: bench.level()[0] > 10, AMPLE_S)
        await bench.arbiter.hold("v1")
        stood = await bench.stands()
        await bench.clock.sleep(6)
        assert math.dist(stood, bench.level()) < 0.2
        await bench.arbiter.resume("v1")
        assert (await bench.ended("r1.b1", AMPLE_S)).state is BehaviorState.SUCCEEDED
        assert bench.level() == pytest.approx((80, 25), abs=2.6)

    fly(main, ROVER)


def test_a_route_with_hundreds_of_waypoints_is_driven() -> None:
    places = [(0.15 * i, 3 * math.sin(i / 20)) for i in range(400)]

    async def main(bench) -> None:
        await bench.do("r1.b1", "single_vehicle_routing", route=route(*places))
        assert bench.level() == pytest.approx(places[-1], abs=2.6)

    fly(main, ROVER)


def test_a_loop_is_driven_again_and_again() -> None:
    async def main(bench) -> None:
        way = route((12, 0), (12, 12), (0, 0))
        await bench.start("r1.b1", "single_vehicle_routing", "v1", route=way, loop=True, speed=4.0)
        async with Track(bench) as track:

            def turns() -> int:
                return sum(a[0] < 6 <= b[0] and b[1] < 4 for a, b in pairwise(track.places))

            assert await bench.until(lambda: turns() >= 3, AMPLE_S)
        await bench.arbiter.cancel("r1.b1", 1)
        assert (await bench.ended("r1.b1", AMPLE_S)).state is BehaviorState.CANCELLED

    fly(main, ROVER)


def test_a_survey_covers_its_area() -> None:
    async def main(bench) -> None:
        await bench.do("r1.b1", "takeoff", altitude=20.0)
        async with Track(bench) as track:
            await bench.do(
                "r1.b2",
                "area_survey",
                area=field(20, 20, 45),
                spacing=15.1,
                altitude=20.0,
                speed=7.0,
            )
        looks = [(20 + e, 20 + n) for e in range(0, 46, 5) for n in range(0, 46, 5)]
        assert max(track.nearest_m(look) for look in looks) < 15.1 / 2 + 2.5

    fly(main, COPTER)


def test_an_orbit_goes_round_at_its_radius() -> None:
    async def main(bench) -> None:
        await bench.do("r1.b1", "takeoff", altitude=15.0)
        await bench.do("r1.b2", "goto", target=point(30, 0))
        async with Track(bench) as track:
            await bench.do("r1.b3", "orbit", target=point(50, 0, 15.0), radius=20.0, speed=5.0)
        radii = [math.dist(place, (50, 0)) for place in track.places[5:]]
        assert all(radius == pytest.approx(20.0, abs=3.0) for radius in radii)
        for place in ((30, 0), (50, 20), (70, 0), (50, -20)):
            assert track.nearest_m(place) < 3.0

    fly(main, COPTER)


@pytest.mark.parametrize("every", [3, 7])
def test_over_a_link_that_loses_frames_all_is_begun_once(every: int) -> None:
    async def main(bench) -> None:
        lose(bench.truth().port, every)
        await do_in_the_end(bench, "r1.b1", "takeoff", altitude=10.0)
        way = route((20, 0), (20, 20))
        await do_in_the_end(bench, "r1.b2", "single_vehicle_routing", route=way)
        assert bench.level() == pytest.approx((20, 20), abs=2.5)
        await do_in_the_end(bench, "r1.b3", "return_to_launch")
        assert (bench.truth().takeoffs, bench.truth().missions_begun) == (1, 1)

    fly(main, COPTER, speed=15.0)


async def do_in_the_end(bench, id_: str, behavior: str, **parameters) -> None:
    """A link that loses so much may defeat an exchange. That is told, and nothing has begun."""
    for attempt in range(5):
        name = f"{id_}{attempt}"
        await bench.start(name, behavior, "v1", **parameters)
        end = await bench.ended(name, 600.0)
        if end.state == "SUCCEEDED":
            return
        assert (end.state, end.code) == ("FAILED", "FAILED"), end
        assert end.reason
    raise AssertionError(f"{behavior} was defeated by the link again and again")


def lose(port, every: int) -> None:
    """Every so-many-th frame is lost, to and fro."""
    for wire in (port.outward, port.inward):
        carry, numbers = wire.carry, count(1)

        def lossy(*frame, carry=carry, numbers=numbers) -> None:
            if next(numbers) % every:
                carry(*frame)

        wire.carry = lossy


def test_a_stored_mission_is_run() -> None:
    async def main(bench) -> None:
        await bench.do("r1.b1", "single_vehicle_routing", route=route((10, 0), (10, 10), (0, 10)))
        await bench.do("r1.b2", "run_onboard_mission", first=1)
        assert bench.level() == pytest.approx((0, 10), abs=2.6)

    fly(main, ROVER)


def test_another_ground_station_that_replaces_the_mission_is_reported_and_not_fought() -> None:
    async def main(bench) -> None:
        way = route((200, 0), (200, 200))
        await bench.start("r1.b1", "single_vehicle_routing", "v1", route=way)
        await bench.running("r1.b1")
        await bench.clock.sleep(5)
        async with another_station(bench) as other:
            items = [waypoint(number, 0, 50) for number in range(5)]
            assert await asyncio.to_thread(other.upload, *items) == ACCEPTED
            end = await bench.ended("r1.b1", AMPLE_S)
        assert (end.state, end.code) == (BehaviorState.FAILED, "TAKEN_OVER"), end
        assert "mission" in end.reason
        assert bench.truth().mode == "AUTO", "it is left to who has it now"

    fly(main, ROVER)


def test_another_ground_station_that_changes_the_mode_is_reported_and_not_fought() -> None:
    async def main(bench) -> None:
        await bench.do("r1.b1", "takeoff", altitude=15.0)
        await bench.start("r1.b2", "goto", "v1", target=point(300, 0))
        await bench.running("r1.b2")
        async with another_station(bench) as other:
            assert await asyncio.to_thread(other.command, DO_SET_MODE, 1, LAND_MODE) == ACCEPTED
            end = await bench.ended("r1.b2", AMPLE_S)
        assert (end.state, end.code) == (BehaviorState.FAILED, "TAKEN_OVER"), end
        assert "LAND" in end.reason
        assert await bench.until(lambda: bench.truth().mode == "LAND", AMPLE_S)
        await bench.clock.sleep(5)
        assert bench.truth().mode == "LAND"

    fly(main, COPTER)


@pytest.mark.parametrize("moment", ["in its mode", "armed"])
def test_another_ground_station_that_stops_a_vehicle_that_is_being_prepared_is_not_overridden(
    moment: str,
) -> None:
    async def main(bench) -> None:
        so_far = {
            "in its mode": lambda: bench.truth().mode == "GUIDED",
            "armed": lambda: bench.truth().armed,
        }[moment]
        async with another_station(bench) as other:
            await bench.start("r1.b1", "goto", "v1", target=point(300, 0))
            assert await bench.until(so_far, AMPLE_S)
            hold = 4
            assert await asyncio.to_thread(other.command, DO_SET_MODE, 1, hold) == ACCEPTED
            end = await bench.ended("r1.b1", AMPLE_S)
        assert (end.state, end.code) == (BehaviorState.FAILED, "TAKEN_OVER"), end
        assert "HOLD" in end.reason
        await bench.clock.sleep(20)
        assert bench.truth().mode == "HOLD"

    fly(main, ROVER, speed=5.0)


def test_a_person_drives_a_rover_from_another_ground_station() -> None:
    async def main(bench) -> None:
        await bench.start("r1.b1", "goto", "v1", target=point(300, 0))
        await bench.running("r1.b1")
        await bench.start("r1.b2", "teleop", "v1", preempts=("r1.b1",))
        await bench.running("r1.b2")
        async with another_station(bench) as other:
            assert await asyncio.to_thread(other.command, DO_SET_MODE, 1, MANUAL_MODE) == ACCEPTED
            assert await bench.until(lambda: bench.truth().mode == "MANUAL", AMPLE_S)
            await bench.clock.sleep(10)
        assert bench.states_of("r1.b2")[-1] is BehaviorState.RUNNING
        await bench.arbiter.cancel("r1.b2", 1)
        assert (await bench.ended("r1.b2", AMPLE_S)).state is BehaviorState.CANCELLED
        assert bench.truth().mode == "HOLD"

    fly(main, ROVER)


@asynccontextmanager
async def another_station(bench):
    """pymavlink's own client, which speaks to the vehicle from elsewhere."""
    host, port = bench.truth().address
    other = Ground(f"udpout:{host}:{port}", system=201)
    try:
        other.link.mav.heartbeat_send(6, 8, 0, 0, 0)
        await asyncio.to_thread(other.link.wait_heartbeat, timeout=40)
        yield other
    finally:
        other.close()


def waypoint(number: int, east_m: float, north_m: float):
    latitude, longitude = at(east_m, north_m)
    x, y = round(latitude * 1e7), round(longitude * 1e7)
    return dialect.MAVLink_mission_item_int_message(
        1, 1, number, 3, 16, 0, 1, 0.0, 0.0, 0.0, 0.0, x, y, 0.0
    )
