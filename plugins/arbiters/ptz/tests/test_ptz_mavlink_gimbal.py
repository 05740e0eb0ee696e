"""Pointing over MAVLink: what the driver says, and where the gimbal really points."""

import asyncio
import math
import socket

import pytest
from m2pem_plugin_mavlink import Address, open_link
from m2pem_plugin_mavlink.simulator.gimbal import Controller
from m2pem_plugin_mavlink.simulator.messages import Result
from m2pem_plugin_mavlink.simulator.specification import Kind
from ptz_mavlink_world import AMPLE_S, REACH, SPEED, until, world

from m2pem.testing.loopback import loop_clock, on_loopback

OURS = Controller(255, 191)
THEIRS = Controller(77, 190)
PITCHYAW = 1000


@pytest.mark.parametrize(
    ("kind", "firmware"),
    [(Kind.COPTER, "ardupilot"), (Kind.ROVER, "ardupilot"), (Kind.COPTER, "px4")],
)
@on_loopback
async def test_a_gimbal_points_from_the_bow_and_says_so(kind: Kind, firmware: str) -> None:
    async with world(kind, spec={"firmware": firmware}) as it:
        await it.ready()
        it.point(40.0, -25.0)
        await until(lambda: it.is_at(40.0, -25.0))
        await until(lambda: it.driver.ptz.pan_rad == pytest.approx(math.radians(40), abs=0.01))
        await until(lambda: it.driver.ptz.tilt_rad == pytest.approx(math.radians(-25), abs=0.01))
        assert it.gimbal.primary == OURS


@on_loopback
async def test_a_gimbal_reaches_no_farther_than_its_gimbal() -> None:
    async with world() as it:
        assert it.driver.reach == REACH
        await it.ready()
        low, high = it.driver.reach.tilt_rad
        assert math.degrees(low) == pytest.approx(-90)
        assert math.degrees(high) == pytest.approx(25)
        assert math.degrees(it.driver.reach.pan_rad[1]) == pytest.approx(160)
        assert it.driver.reach.zoom_max == REACH.zoom_max


@on_loopback
async def test_the_last_order_counts() -> None:
    async with world() as it:
        await it.ready()
        for pan in range(60):
            it.point(pan, 0.0)
        it.point(-30.0, -10.0)
        await until(lambda: it.is_at(-30.0, -10.0))
        await it.clock.sleep(2.0)
        assert it.is_at(-30.0, -10.0)


@on_loopback
async def test_an_order_whose_message_is_lost_is_given_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with world() as it:
        await it.ready()
        it.point(5.0, 0.0)
        await until(lambda: it.is_at(5.0, 0.0))
        receive, lost = it.real.autopilot.receive, []

        def lossy(message, *arguments):
            if message.get_type() == "GIMBAL_MANAGER_SET_PITCHYAW":
                lost.append(message)
            else:
                receive(message, *arguments)

        monkeypatch.setattr(it.real.autopilot, "receive", lossy)
        it.point(20.0, -20.0)
        await until(lambda: it.is_at(20.0, -20.0))
        assert lost


@on_loopback
async def test_a_gimbal_turns_no_faster_than_asked() -> None:
    async with world() as it:
        await it.ready()
        began_s = it.clock.now_us() / 1e6
        it.point(60.0, 0.0, rate_deg_s=10.0)
        await until(lambda: it.truly_deg[0] > 28.0)
        half_s = it.clock.now_us() / 1e6 - began_s
        await until(lambda: it.is_at(60.0, 0.0, 1.0))
        whole_s = it.clock.now_us() / 1e6 - began_s
        assert half_s > 2.5
        assert whole_s > 5.5


@on_loopback
async def test_orders_that_follow_each_other_keep_the_rate() -> None:
    async with world() as it:
        await it.ready()
        began_s = it.clock.now_us() / 1e6
        async with asyncio.timeout(AMPLE_S):
            while not it.is_at(40.0, 0.0, 1.0):
                it.point(40.0, 0.0, rate_deg_s=10.0)
                await it.clock.sleep(0.25)
        assert it.clock.now_us() / 1e6 - began_s > 3.5


@on_loopback
async def test_halt_stops_it_on_its_way() -> None:
    async with world() as it:
        await it.ready()
        it.point(150.0, 0.0, rate_deg_s=6.0)
        await until(lambda: it.truly_deg[0] > 30.0)
        it.driver.halt()
        stood = await it.stands()
        assert stood[0] < 140.0
        await it.clock.sleep(2.0)
        assert it.truly_deg == pytest.approx(stood, abs=0.5)


@on_loopback
async def test_a_gimbal_that_knows_no_rates_is_halted_by_pointing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with world() as it:
        await it.ready()
        receive, refused = it.real.autopilot.receive, []

        def knows_no_rates(message, *arguments):
            orders = getattr(message, "command", None) == PITCHYAW
            if orders and math.isnan(message.param1):
                refused.append(message)
                it.real.faults.refuse_command(PITCHYAW, Result.DENIED, times=1)
            receive(message, *arguments)

        monkeypatch.setattr(it.real.autopilot, "receive", knows_no_rates)
        it.point(150.0, 0.0, rate_deg_s=6.0)
        await until(lambda: it.truly_deg[0] > 30.0)
        it.driver.halt()
        await until(lambda: bool(refused))
        assert (await it.stands())[0] < 140.0


@on_loopback
async def test_a_gimbal_from_the_bow_turns_with_its_vehicle() -> None:
    async with world() as it:
        await it.ready()
        it.point(30.0, 0.0)
        await until(lambda: it.is_at(30.0, 0.0))
        it.real.autopilot.body.yaw_rad += math.radians(40)
        await it.clock.sleep(2.0)
        assert it.is_at(30.0, 0.0)


@on_loopback
async def test_a_gimbal_from_north_stays_when_its_vehicle_turns() -> None:
    async with world(own={"yaw": "north"}) as it:
        await it.ready()
        it.vehicle_is(yaw_rad=0.0)  # its bow is to the east
        it.point(30.0, 0.0)
        await until(lambda: it.is_at(30.0, 0.0))
        it.real.autopilot.body.yaw_rad += math.radians(40)
        await until(lambda: it.is_at(-10.0, 0.0))
        await until(lambda: abs(math.degrees(it.driver.ptz.pan_rad) + 10.0) < 0.6)


@on_loopback
async def test_what_is_meant_from_the_deck_is_told_from_the_horizon() -> None:
    async with world(stabilized=False) as it:
        await it.ready()
        it.vehicle_is(yaw_rad=0.0, pitch_rad=math.radians(10.0))  # the nose is down
        it.point(0.0, 0.0)
        await until(lambda: it.is_at(0.0, -10.0))
        await until(lambda: abs(it.driver.ptz.tilt_rad) < math.radians(0.6))


@on_loopback
async def test_another_station_in_control_is_not_fought() -> None:
    async with world() as it:
        await it.ready()
        it.point(30.0, 0.0)
        await until(lambda: it.is_at(30.0, 0.0))
        it.gimbal.primary = THEIRS
        it.gimbal.pointing.point(0.0, math.radians(-60), locked=False)
        await until(lambda: "system 77" in it.driver.refusal("ptz_point_at"))
        it.point(30.0, 0.0)
        await until(lambda: it.is_at(-60.0, 0.0))
        await it.clock.sleep(3.0)
        assert it.is_at(-60.0, 0.0)
        assert it.gimbal.primary == THEIRS
        assert it.driver.refusal("take_picture") == ""


@on_loopback
async def test_control_is_taken_again_when_the_other_station_has_released_it() -> None:
    async with world(spec={"firmware": "px4"}) as it:
        it.gimbal.primary = THEIRS
        await until(lambda: "system 77" in it.driver.refusal("ptz_scan_sector"))
        it.gimbal.primary = Controller()
        await it.ready()
        it.point(10.0, 0.0)
        await until(lambda: it.is_at(10.0, 0.0))
        assert it.gimbal.primary == OURS


@on_loopback
async def test_a_gimbal_is_left_to_others_in_the_end() -> None:
    async with world() as it:
        await it.ready()
        it.point(30.0, -5.0)
        await until(lambda: it.is_at(30.0, -5.0))
        gimbal = it.gimbal
    assert gimbal.primary == Controller()
    assert math.degrees(gimbal.pointing.wanted_yaw_rad) == pytest.approx(30.0, abs=0.5)


@on_loopback
async def test_a_gimbal_is_connected_as_long_as_it_says_where_it_points() -> None:
    async with world() as it:
        await it.ready()
        before = len(it.heard)
        await until(lambda: len(it.heard) > before + 5)
        it.real.faults.cut_link()
        await it.clock.sleep(5.0)
        before = len(it.heard)
        await it.clock.sleep(5.0)
        assert len(it.heard) == before


@on_loopback
async def test_after_a_restart_of_the_autopilot_it_is_heard_again() -> None:
    async with world() as it:
        await it.ready()
        it.real.autopilot.reboot()
        await it.clock.sleep(4.0)
        before = len(it.heard)
        await until(lambda: len(it.heard) > before + 5)


@on_loopback
async def test_a_vehicle_without_a_gimbal_says_who_did_not_answer() -> None:
    async with world(spec={"gimbal": False}) as it:
        await it.ready("take_picture")
        await until(lambda: "(" in it.driver.refusal("ptz_track"))
        assert "component 1 of system 1 has not reported" in it.driver.refusal("ptz_track")
        assert it.driver.ptz is None
        await until(lambda: it.heard)  # by its camera


@on_loopback
async def test_the_socket_is_that_of_the_vehicles_arbiter() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    url = f"udpin://127.0.0.1:{port}"
    link = await open_link(Address(1, 1), [url], loop_clock(SPEED))
    try:
        async with world(to=("127.0.0.1", port), own={"url": url}) as it:
            await it.ready()
            it.point(20.0, 0.0)
            await until(lambda: it.is_at(20.0, 0.0))
            assert link.quality() is not None
        assert link.quality() is not None
    finally:
        await link.close()


@on_loopback
async def test_a_fixed_camera_looks_ahead() -> None:
    async with world(spec={"gimbal": False}, own={"gimbal": False}) as it:
        await it.ready("take_picture")
        assert (it.driver.ptz.pan_rad, it.driver.ptz.tilt_rad) == (0.0, 0.0)
        assert "cannot turn" in it.driver.refusal("ptz_point_at")
        await it.driver.take_picture()


@on_loopback
async def test_a_manager_that_denies_is_told_of_once_for_each_order(caplog) -> None:
    async with world() as it:
        await it.ready()
        it.real.faults.refuse_command(PITCHYAW, Result.DENIED, "Gimbal: stuck")
        it.point(10.0, 0.0)
        await until(lambda: "v1/ptz: gimbal:" in caplog.text)
        assert caplog.text.count("v1/ptz: gimbal:") == 1
