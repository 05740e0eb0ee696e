"""Vehicles and their drivers against simulated autopilots, over real UDP."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest
from m2pem_plugin_mavlink.link.routed_link import open_link
from m2pem_plugin_mavlink.microservices.mission_items import MissionItem
from m2pem_plugin_mavlink.microservices.missions import ReadMissionItem
from m2pem_plugin_mavlink.protocol.messages import Address
from m2pem_plugin_mavlink.protocol.transaction import RefusedError
from m2pem_plugin_mavlink.simulator.simulator import SimulatedVehicle, Simulator
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec
from m2pem_plugin_mavlink.vehicle import failsafe
from m2pem_plugin_mavlink.vehicle.driver import FlightMode, TargetPosition
from m2pem_plugin_mavlink.vehicle.takeover_monitor import Cause, TakeoverMonitor
from m2pem_plugin_mavlink.vehicle.vehicle import Vehicle
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import LinkState, ResourceId
from m2pem.testing.loopback import loop_clock, on_loopback

SPEED = 20.0
AMPLE_S = 400.0
"""Of that clock: twenty real seconds."""

OWN = Address(245, 190)


@asynccontextmanager
async def flying(
    kind: Kind = Kind.COPTER, firmware: str = "ardupilot"
) -> AsyncIterator[tuple[SimulatedVehicle, Vehicle]]:
    spec = VehicleSpec(kind, firmware=firmware, estimator_s=6.0)
    async with Simulator([spec], speed=SPEED, to=None) as simulator:
        host, port = simulator[1].address
        clock = loop_clock(SPEED)
        link = await open_link(Address(1, 1), [f"udpout://{host}:{port}"], clock, OWN)
        domain = "air" if kind is Kind.COPTER else "ground"
        vehicle = Vehicle(ResourceId("uav1"), domain, link, clock)
        vehicle.open()
        try:
            assert await vehicle.identified(AMPLE_S)
            yield simulator[1], vehicle
        finally:
            await vehicle.close()
            await link.close()


@on_loopback
async def test_a_copter_waits_for_its_estimator_takes_off_goes_and_returns() -> None:
    async with flying() as (truth, vehicle):
        assert vehicle.telemetry().ready is False
        driver = vehicle.driver
        await driver.take_off(10.0)
        assert (truth.armed, truth.takeoffs) == (True, 1)
        assert await vehicle.until(
            lambda: (vehicle.state.altitude_above_home_m or 0) > 9.0, AMPLE_S
        )
        assert vehicle.state.landed is False
        await driver.go_to(TargetPosition(47.3982, 8.545594, 20.0), 8.0)
        there = 47.3982 - 2e-6
        arrived = lambda: vehicle.state.position.latitude_deg > there  # noqa: E731
        assert await vehicle.until(arrived, AMPLE_S)
        assert truth.location.latitude_deg == pytest.approx(47.3982, abs=1e-5)
        await driver.return_home()
        assert await vehicle.until(lambda: vehicle.state.armed is False, AMPLE_S)
        assert await vehicle.until(lambda: vehicle.state.landed is True, AMPLE_S)


@on_loopback
async def test_a_takeoff_that_was_stopped_on_the_ground_can_be_begun_again() -> None:
    async with flying() as (truth, vehicle):
        await vehicle.driver.take_off(6.0)
        await vehicle.driver.stop()
        assert await vehicle.until(lambda: vehicle.state.armed is False, AMPLE_S)
        assert truth.mode == "BRAKE"
        await vehicle.driver.take_off(6.0)
        assert await vehicle.until(
            lambda: (vehicle.state.altitude_above_home_m or 0) > 5.0, AMPLE_S
        )


@on_loopback
async def test_a_copter_stands_soon_after_a_stop() -> None:
    async with flying() as (truth, vehicle):
        await vehicle.driver.take_off(10.0)
        await vehicle.until(lambda: (vehicle.state.altitude_above_home_m or 0) > 9.0, AMPLE_S)
        await vehicle.driver.go_to(TargetPosition(47.41, 8.545594, 10.0), 8.0)
        assert await vehicle.until(lambda: 7.0 < vehicle.state.speed_m_s < 20.0, AMPLE_S)
        await vehicle.driver.stop()
        assert truth.mode == "BRAKE"
        assert await vehicle.until(lambda: vehicle.state.speed_m_s < 0.2, AMPLE_S)


@on_loopback
async def test_velocities_move_it_while_they_are_repeated() -> None:
    async with flying() as (_, vehicle):
        await vehicle.driver.take_off(10.0)
        await vehicle.until(lambda: (vehicle.state.altitude_above_home_m or 0) > 9.0, AMPLE_S)
        async with asyncio.timeout(AMPLE_S / SPEED):
            while vehicle.state.velocity_enu_m_s[:2] != pytest.approx((3.0, 0.0), abs=0.3):
                await vehicle.driver.move((0.0, 3.0, 0.0))
                await vehicle.sleep(0.5)
        assert await vehicle.until(lambda: vehicle.state.speed_m_s < 0.2, AMPLE_S)


@on_loopback
async def test_a_rover_is_armed_drives_holds_and_does_not_take_off() -> None:
    async with flying(Kind.ROVER) as (truth, vehicle):
        with pytest.raises(RefusedError, match="a rover does not take off"):
            await vehicle.driver.take_off(10.0)
        await vehicle.driver.go_to(TargetPosition(47.3982, 8.545594))
        assert truth.mode == "GUIDED"
        assert await vehicle.until(lambda: 1.0 < vehicle.state.speed_m_s < 20.0, AMPLE_S)
        await vehicle.driver.stop()
        assert truth.mode == "HOLD"
        assert await vehicle.until(lambda: vehicle.state.speed_m_s < 0.2, AMPLE_S)
        assert vehicle.state.landed is True


@on_loopback
async def test_another_ground_station_is_noticed() -> None:
    async with flying() as (truth, vehicle):
        watch = TakeoverMonitor(vehicle, OWN.system)
        watch.open()
        await vehicle.driver.take_off(10.0)
        await vehicle.until(lambda: (vehicle.state.altitude_above_home_m or 0) > 9.0, AMPLE_S)
        flying_modes = {FlightMode.GUIDED}
        assert watch.takeover(flying_modes) is None
        host, port = truth.address
        url = f"udpout://{host}:{port}"
        link = await open_link(Address(1, 1), [url], loop_clock(SPEED), Address(254, 190))
        other = Vehicle(ResourceId("qgc"), "air", link, loop_clock(SPEED))
        other.open()
        assert await other.identified(AMPLE_S)
        await other.driver.set_mode(FlightMode.LAND)
        assert await vehicle.until(lambda: watch.takeover(flying_modes) is not None, AMPLE_S)
        takeover = watch.takeover(flying_modes)
        assert takeover is not None
        assert takeover.cause is Cause.STATION
        assert "from GUIDED to LAND" in takeover.reason
        await other.close()
        await link.close()
        await watch.close()


def waypoint(latitude_deg: float, altitude_m: float = 10.0) -> MissionItem:
    frame = dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT
    return MissionItem(16, frame, (0.0, 0.0, 0.0, 0.0), latitude_deg, 8.545594, altitude_m)


TAKEOFF = MissionItem(22, dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT, altitude_m=10.0)
ROUTE = (TAKEOFF, waypoint(47.3979), waypoint(47.3981), waypoint(47.3983))


@on_loopback
async def test_a_mission_is_stored_read_and_flown_from_the_ground() -> None:
    async with flying() as (truth, vehicle):
        driver = vehicle.driver
        await driver.upload(ROUTE)
        stored = await driver.downloaded()
        assert len(stored) == len(ROUTE)
        assert all(a.same_as(b) for a, b in zip(stored[1:], ROUTE[1:], strict=True))
        await driver.start_mission()
        assert (truth.mode, truth.armed) == ("AUTO", True)
        assert await vehicle.until(lambda: driver.reached_item == 2, AMPLE_S)
        assert await vehicle.until(lambda: driver.current_item == 3, AMPLE_S)
        assert await vehicle.until(lambda: driver.reached_item == 3, AMPLE_S)
        await driver.start_mission(1)
        assert driver.reached_item is None
        assert await vehicle.until(lambda: driver.current_item == 1, AMPLE_S)
        await driver.stop()
        await driver.upload(())
        assert await driver.downloaded() == ()


@on_loopback
async def test_a_rover_drives_a_mission() -> None:
    async with flying(Kind.ROVER) as (truth, vehicle):
        await vehicle.driver.upload(ROUTE[1:])
        await vehicle.driver.start_mission(1)
        assert truth.mode == "AUTO"
        assert await vehicle.until(lambda: vehicle.driver.reached_item == 1, AMPLE_S)


@pytest.mark.parametrize(
    ("replaced", "words"),
    [
        (ROUTE[:2], "has replaced the mission: it has 2 items, not 4"),
        ((TAKEOFF, *(waypoint(47.396 - n / 1000) for n in range(3))), "is not ours"),
    ],
)
@on_loopback
async def test_another_mission_by_another_ground_station_is_noticed(
    replaced: tuple[MissionItem, ...], words: str
) -> None:
    async with flying() as (truth, vehicle):
        watch = TakeoverMonitor(vehicle, OWN.system)
        watch.open()
        await vehicle.driver.upload(ROUTE)
        await vehicle.driver.start_mission()
        assert await vehicle.until(lambda: vehicle.driver.current_item == 1, AMPLE_S)
        mission_modes = {FlightMode.MISSION}
        await vehicle.sleep(3.0)
        assert watch.takeover(mission_modes) is None
        host, port = truth.address
        url = f"udpout://{host}:{port}"
        link = await open_link(Address(1, 1), [url], loop_clock(SPEED), Address(254, 190))
        other = Vehicle(ResourceId("qgc"), "air", link, loop_clock(SPEED))
        other.open()
        assert await other.identified(AMPLE_S)
        await other.driver.upload(replaced)
        assert await vehicle.until(lambda: watch.takeover(mission_modes) is not None, AMPLE_S)
        takeover = watch.takeover(mission_modes)
        assert takeover is not None
        assert words in takeover.reason or "begun to replace the mission" in takeover.reason
        await other.close()
        await link.close()
        await watch.close()


def test_a_late_answer_about_an_earlier_mission_is_no_takeover(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    late = [waypoint(47.0)]

    @on_loopback
    async def story() -> None:
        async with flying() as (_, vehicle):
            perform = vehicle.link.perform

            async def answered(exchange: Any) -> Any:
                found = await perform(exchange)
                return late.pop() if late and isinstance(exchange, ReadMissionItem) else found

            monkeypatch.setattr(vehicle.link, "perform", answered)
            watch = TakeoverMonitor(vehicle, OWN.system)
            watch.open()
            await vehicle.driver.upload(ROUTE)
            await vehicle.driver.start_mission()
            assert await vehicle.until(lambda: not late, AMPLE_S)
            assert await vehicle.until(lambda: vehicle.driver.current_item == 2, AMPLE_S)
            assert watch.takeover({FlightMode.MISSION}) is None
            await watch.close()

    story()


@on_loopback
async def test_failsafes_are_read_and_compared() -> None:
    async with flying() as (truth, vehicle):
        truth.autopilot.parameters["FS_GCS_ENABLE"] = 0.0
        monitor = failsafe.FailsafeMonitor(vehicle, "return_to_launch", OWN.system)
        found = await monitor.findings()
        texts = [str(each) for each in found]
        assert (
            "uav1: fleet says return_to_launch on loss of link, FS_GCS_ENABLE is 0 (disabled): "
            "set it to 1"
        ) in texts
        assert any("monitors the ground station with system id 255" in text for text in texts)
        truth.autopilot.parameters["FS_GCS_ENABLE"] = 1.0
        found = await monitor.findings()
        assert "FS_GCS_ENABLE" not in [each.parameter for each in found]


@on_loopback
async def test_a_refusal_says_why() -> None:
    async with flying() as (_, vehicle):
        with pytest.raises(RefusedError, match=r"COMPONENT_ARM_DISARM: failed \(.*Arm: .+\)"):
            await vehicle.driver.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)


@on_loopback
async def test_a_cut_link_is_lost_and_found_again() -> None:
    async with flying() as (truth, vehicle):
        await vehicle.until(lambda: vehicle.state.home is not None, AMPLE_S)
        truth.faults.cut_link()
        assert await vehicle.until(lambda: vehicle.link_state is LinkState.LOST, AMPLE_S)
        truth.faults.restore_link()
        assert await vehicle.until(lambda: vehicle.link_state is LinkState.CONNECTED, AMPLE_S)
        assert vehicle.state.boots == 1
