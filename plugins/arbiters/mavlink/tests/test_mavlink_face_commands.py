"""What commands of ground stations mean, and modes that wait for targets."""

import asyncio
import math
from pathlib import Path

import pytest
from m2pem_plugin_mavlink.face.commands import Command, order_of
from m2pem_plugin_mavlink.face.vehicle import ShownVehicle
from mavlink_gcs import HOME, gateway, ground_station
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import GeoPosition, ResourceId, VehicleState

ROVER1, UAV1 = 1, 2


@pytest.mark.parametrize(
    ("home_m", "height_m", "frame", "z", "expected"),
    [
        (488.0, 2.5, "relative", 498.0, "amsl"),  # MAVSDK's example do_orbit, after its takeoff
        (488.0, 15.0, "relative", 15.0, "relative"),
        (100.0, 118.0, "relative", 120.0, "relative"),
        (5.0, 15.0, "relative", 15.0, "relative"),
        (5.0, 15.0, "relative", 20.0, "amsl"),
        (-3.0, 10.0, "relative", 10.0, "relative"),
        (488.0, 2.5, "amsl", 498.0, "amsl"),
        (488.0, 2.5, "terrain", 20.0, "terrain"),
        (488.0, 2.5, "relative", math.nan, None),
    ],
)
def test_the_height_of_an_orbit_is_the_one_nearer_to_the_vehicles(
    home_m: float, height_m: float, frame: str, z: float, expected: str | None
) -> None:
    """`do_orbit` of MAVSDK 3.15 and 4.1 sends an altitude above sea level in the frame
    MAV_FRAME_GLOBAL_RELATIVE_ALT (action_impl.cpp: no frame, which is that one); PX4's
    FlightTaskOrbit looks at no frame."""
    home = GeoPosition(*HOME, home_m)
    position = GeoPosition(*HOME, home_m + height_m)
    resource = ResourceId("uav1")
    state = VehicleState(resource, 0, position=position, altitude_above_home_m=height_m)
    vehicle = ShownVehicle(resource, "air", 2, {"orbit"}, home=home, state=state)
    orbit = dialect.MAV_CMD_DO_ORBIT
    command = Command(orbit, (10.0, 2.0, 0.0, math.nan), HOME, z, frame, 0)
    order = order_of(command, vehicle, None)
    assert order is not None
    assert order.parameters.get("altitude_frame") == expected


def test_guided_ends_what_a_vehicle_does_and_stays_until_another_mode(tmp_path: Path) -> None:
    async def main() -> None:
        async with (
            gateway(tmp_path, commands="all") as (control, port),
            ground_station(port) as station,
        ):
            is_it = lambda each: each.get_srcSystem() == ROVER1  # noqa: E731
            await station.hears("HEARTBEAT", is_it)
            station.mav.request_data_stream_send(ROVER1, 1, 0, 4, 1)
            far = HOME[0] + 0.005, HOME[1]
            assert await station.go_to(ROVER1, far) == 0
            guided, hold = dialect.ROVER_MODE_GUIDED, dialect.ROVER_MODE_HOLD
            set_mode = dialect.MAV_CMD_DO_SET_MODE
            assert await station.command(ROVER1, set_mode, 1, guided) == 0
            await station.told("rover1 ends hold: succeeded")
            is_guided = lambda each: is_it(each) and each.custom_mode == guided  # noqa: E731
            await station.hears("HEARTBEAT", is_guided, len(station.received))
            assert await station.go_to(ROVER1, far) == 0
            # A second one, as repeated by a program that waits for it, does not stop the vehicle.
            station.mav.set_mode_send(ROVER1, 1, guided)
            await station.result(ROVER1, set_mode, len(station.received))
            going = [each for each in await control.runs() if each.ended_us is None]
            assert [each.mission for each in going] == ["goto of rover1"]
            assert await station.command(ROVER1, set_mode, 1, hold) == 0
            is_held = lambda each: is_it(each) and each.custom_mode == hold  # noqa: E731
            await station.hears("HEARTBEAT", is_held, len(station.received))

    asyncio.run(main())


def test_what_is_not_carried_out_is_refused_with_what_to_send(tmp_path: Path) -> None:
    async def main() -> None:
        async with (
            gateway(tmp_path, commands="all") as (control, port),
            ground_station(port) as station,
        ):
            await station.hears("HEARTBEAT", lambda each: each.get_srcSystem() == UAV1)
            level = 1.0, 0.0, 0.0, 0.0
            station.mav.gimbal_manager_set_attitude_send(UAV1, 1, 0, 1, level, 0, 0.09, 0)
            await station.told("SET_ATTITUDE is not carried out", "DO_GIMBAL_MANAGER_PITCHYAW")
            station.mav.set_attitude_target_send(0, UAV1, 1, 0, level, 0, 0, 0, 0.6)
            await station.told("SET_ATTITUDE_TARGET", "send SET_POSITION_TARGET_GLOBAL_INT")
            station.mav.param_set_send(UAV1, 1, b"FLW_TGT_HT", 8.0, 9)
            await station.told("FLW_TGT_HT: parameters are read-only here")
            assert not await control.runs()

    asyncio.run(main())
