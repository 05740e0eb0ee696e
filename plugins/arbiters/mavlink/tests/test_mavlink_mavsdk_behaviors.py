"""Behaviors with `driver: mavsdk`, on simulated autopilots over real UDP."""

import math

import pytest
from m2pem_plugin_mavlink.simulator.specification import Kind
from mavlink_simulated import MAVSDK_SPEED, at, fly

from m2pem.api import Area, Point, Route


def by_mavsdk(main, *kinds):
    fly(main, *kinds, speed=MAVSDK_SPEED, driver="mavsdk")


def test_a_copter_takes_off_flies_a_route_circles_and_returns():
    async def main(bench):
        await bench.do("r1.b1", "takeoff", altitude=10.0)
        places = tuple((*at(*place), 15.0) for place in ((30.0, 0.0), (30.0, 30.0)))
        await bench.do("r1.b2", "single_vehicle_routing", route=Route(places), speed=8.0)
        assert bench.level() == pytest.approx((30.0, 30.0), abs=3.0)
        center = Point((*at(30.0, 40.0), None))
        await bench.do("r1.b3", "orbit", target=center, radius=10.0, turns=1.0)
        await bench.do("r1.b4", "return_to_launch")
        assert math.hypot(*bench.level()) < 2.0
        assert not bench.truth().armed
        assert bench.truth().takeoffs == 1

    by_mavsdk(main, Kind.COPTER)


@pytest.mark.long
def test_a_copter_surveys_an_area_and_lands():
    async def main(bench):
        await bench.do("r1.b1", "takeoff", altitude=10.0)
        corners = ((10, 10), (60, 10), (60, 40), (10, 40), (10, 10))
        area = Area((tuple((*at(*corner), None) for corner in corners),))
        await bench.do("r1.b2", "area_survey", area=area, spacing=10.0, speed=10.0)
        await bench.do("r1.b3", "land")
        assert bench.truth().up_m == pytest.approx(0.0, abs=0.3)

    by_mavsdk(main, Kind.COPTER)


def test_a_rover_drives_holds_goes_on_and_backs_up():
    async def main(bench):
        there = Point((*at(30.0, 0.0), None))
        await bench.do("r1.b1", "goto", target=there, speed=3.0)
        assert bench.level() == pytest.approx((30.0, 0.0), abs=3.0)
        await bench.do("r1.b2", "reverse", distance=5.0)
        assert bench.level()[0] == pytest.approx(25.0, abs=3.0)
        await bench.do("r1.b3", "deploy", actuator="servo 9", value=1700.0)
        assert bench.truth().autopilot.payload.servos_us == {9: 1700}

    by_mavsdk(main, Kind.ROVER)
