"""The battery of a vehicle will be too low for what is left: another does it in time."""

import math
from dataclasses import replace

import pytest

from m2pem.api.telemetry import GeoPosition, VehicleState
from m2pem.engine.records import WorkReassigned
from m2pem.executive.battery_forecast import rest_of
from m2pem.geo.local_frame import LocalFrame
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.mission.geometry import Area, Point, Route, VehiclePosition

from . import conftest
from .conftest import World
from .test_allocator import one

ORIGIN = (0.0, 0.0, 0.0)
DEGREE_M = 110_574.0
FAR = '<m2pem:property name="target" value="[0.05, 0.0, 0]"/>'
SPEED = '<m2pem:property name="speed" value="10 m/s"/>'


def says(world: World, vehicle: str, north_m: float, charge: float) -> None:
    place = GeoPosition(north_m / DEGREE_M, 0.0, 0.0)
    state = VehicleState(ResourceId(vehicle), world.clock.now_us(), place, battery_fraction=charge)
    world.fake.say(state)


@pytest.fixture
def endurance(monkeypatch):
    """Every vehicle of the fleet lasts 500 s."""
    made = conftest.fleet

    def with_endurance(*names: str):
        fleet = made(*names)
        vehicles = {
            each: replace(vehicle, endurance_s=500.0) for each, vehicle in fleet.vehicles.items()
        }
        return replace(fleet, vehicles=vehicles)

    monkeypatch.setattr(conftest, "fleet", with_endurance)


@pytest.mark.parametrize("role", ["requires='true' onLoss='reassign'", "requires='true'"])
def test_a_vehicle_that_must_turn_back_before_the_end_is_relieved(play, endurance, role):
    """5500 m at 10 m/s and back need 1100 s, and it has 500 s: it turns back after some 200 s, with
    a fifth and the way home left. Without onLoss it is as before."""

    async def story(world: World):
        says(world, "ugv1", 0.0, 1.0)
        says(world, "ugv2", 0.0, 1.0)
        await world.clock.sleep(0.1)
        run = await world.executive.control.start(one(role, "goto", FAR + SPEED))
        await world.fake.until_called("start", f"{run}.b1")
        world.fake.report(f"{run}.b1", BehaviorState.RUNNING)
        for second in range(1, 260):
            await world.clock.sleep(1)
            says(world, "ugv1", 10.0 * second, 1.0 - second / 500)
        lost = [each for each in world.seen if isinstance(each, WorkReassigned)]
        for number in ("b1", "b2"):
            world.fake.report(f"{run}.{number}", BehaviorState.SUCCEEDED)
        await world.executive.control.wait(run)
        return lost

    lost = play(story, "ugv1", "ugv2")
    if "onLoss" not in role:
        assert lost == []
        return
    (record,) = lost
    assert (record.code, record.excluded) == ("BATTERY_LOW", ("ugv1",))
    charge = int(record.reason.removeprefix("battery at ").partition("%")[0]) / 100
    assert 0.2 <= charge - (1.0 - charge) < 0.25


FRAME = LocalFrame(ORIGIN)
KM = 1000.0 / DEGREE_M


@pytest.mark.parametrize(
    ("parameters", "length_m", "end"),
    [
        ({"route": Route(((KM, 0.0, None), (KM, KM, None)))}, 2000.0, (1000.0, 1000.0)),
        ({"target": Point((KM, 0.0, None))}, 1000.0, (0.0, 1000.0)),
        ({"target": VehiclePosition("lead")}, 0.0, (0.0, 0.0)),
        ({"speed": 2.0}, 0.0, (0.0, 0.0)),
        (
            {
                "area": Area(
                    (
                        tuple(
                            (n * KM, e * KM, None)
                            for n, e in ((0, 0), (0, 1), (1, 1), (1, 0), (0, 0))
                        ),
                    )
                ),
                "spacing": 50.0,
            },
            20_000.0,
            (0.0, 0.0),
        ),
    ],
)
def test_how_long_what_is_left_is(parameters, length_m, end):
    found_m, found_end = rest_of(parameters, FRAME, (0.0, 0.0))
    assert found_m == pytest.approx(length_m, rel=0.02)
    assert found_end == pytest.approx(end, abs=20.0)


def test_a_route_that_is_repeated_has_no_end():
    parameters = {"route": Route(((KM, 0.0, None), (KM, KM, None))), "loop": True}
    assert math.isinf(rest_of(parameters, FRAME, (0.0, 0.0))[0])
