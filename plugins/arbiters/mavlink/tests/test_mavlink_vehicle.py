import asyncio
import logging
from collections.abc import Callable
from typing import Any

import pytest
from m2pem_plugin_mavlink.protocol.messages import Address
from m2pem_plugin_mavlink.protocol.transaction import NoAnswerError
from m2pem_plugin_mavlink.vehicle.driver import FlightMode
from m2pem_plugin_mavlink.vehicle.vehicle import Vehicle
from mavlink_vehicle_world import (
    ACCEPTED,
    DENIED,
    UAV1,
    Playing,
    ScriptedLink,
    copter,
    fly,
    make,
    rover,
)
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import Clock, GeoPosition, LinkState

Run = Callable[[Callable[[Clock], Any]], Any]

SET_INTERVAL = dialect.MAV_CMD_SET_MESSAGE_INTERVAL


def intervals_asked(link: ScriptedLink) -> list[int]:
    return [int(each.param1) for each in link.of("COMMAND_LONG", SET_INTERVAL)]


def test_a_vehicle_is_known_by_its_heartbeat_and_nothing_is_sent_before(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        link, vehicle = copter(clock)
        vehicle.open()
        assert not await vehicle.identified(2.0)
        assert (link.sent, vehicle.telemetry().link) == ([], LinkState.LOST)
        with pytest.raises(NoAnswerError, match="uav1 has sent no message yet"):
            _ = vehicle.driver
        link.switch_on()
        assert await vehicle.identified(2.0)
        assert vehicle.driver.name == "ArduPilot"
        await vehicle.close()
        await link.switch_off()

    virtual(main)


@pytest.mark.parametrize(
    ("sender", "fields"),
    [
        (Address(1, 100), {"autopilot": 3, "type": 2}),
        (Address(2, 1), {"autopilot": 3, "type": 2}),
        (Address(1, 1), {"autopilot": 8, "type": 6}),
    ],
)
def test_others_are_not_taken_for_it(virtual: Run, sender: Address, fields: Any) -> None:
    async def main(clock: Clock) -> None:
        link, vehicle = copter(clock)
        vehicle.open()
        link.hear(make("HEARTBEAT", **fields), sender)
        assert vehicle.identity is None
        await vehicle.close()

    virtual(main)


def test_an_autopilot_that_cannot_be_driven_is_told_of_once(
    virtual: Run, caplog: pytest.LogCaptureFixture
) -> None:
    async def main(clock: Clock) -> None:
        link, vehicle = copter(clock)
        vehicle.open()
        for _ in range(3):
            link.hear(make("HEARTBEAT", autopilot=8, type=6))
        await vehicle.close()

    virtual(main)
    assert caplog.text.count("system id 1 is not a vehicle with ArduPilot or PX4") == 1


def test_a_second_vehicle_with_the_same_id_is_told_of(
    virtual: Run, caplog: pytest.LogCaptureFixture
) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            for autopilot in (3, 12, 8, 3, 12):
                link.hear(make("HEARTBEAT", autopilot=autopilot, type=10, custom_mode=4))
            assert vehicle.driver.mode_name(4) == "GUIDED"

    virtual(main)
    assert caplog.text.count("do two vehicles have system id 1?") == 1


def test_a_domain_that_the_heartbeat_denies_is_told_of(
    virtual: Run, caplog: pytest.LogCaptureFixture
) -> None:
    async def main(clock: Clock) -> None:
        link, _ = rover(clock)
        async with Playing((link, Vehicle(UAV1, "air", link, clock))):
            pass

    with caplog.at_level(logging.WARNING):
        virtual(main)
    assert "uav1: the fleet says air, its heartbeat rover" in caplog.text


def test_its_state_is_what_it_says(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            fly(link)
            link.custom_mode = 4
            await vehicle.until(lambda: not vehicle.state.landed and bool(vehicle.state.armed), 5.0)
            state = vehicle.telemetry()
            assert state.position == GeoPosition(47.397742, 8.545594, 498.0)
            assert state.altitude_above_home_m == 10.0
            assert (state.mode, state.armed, state.ready) == ("GUIDED", True, True)
            assert (state.battery_fraction, state.link) == (0.9, LinkState.CONNECTED)
            assert (state.landed, state.home) == (False, GeoPosition(47.397742, 8.545594, 488.0))
            assert vehicle.state.mode is FlightMode.GUIDED

    virtual(main)


def test_a_vehicle_says_why_it_is_not_ready(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        link, vehicle = copter(clock)
        link.says["EKF_STATUS_REPORT"] = {"flags": 0xA7}
        async with Playing((link, vehicle)):
            (reason,) = vehicle.telemetry().not_ready_reasons
            assert reason.startswith("EKF: no position yet")

    virtual(main)


def test_silence_degrades_and_loses_the_link_and_wakes_who_waits_for_it(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            seen: list[LinkState] = []
            vehicle.watch(lambda: seen.append(vehicle.link_state))
            await link.switch_off()
            began_us = clock.now_us()
            assert await vehicle.until(lambda: vehicle.link_state is LinkState.LOST, 60.0)
            assert 2_500_000 < clock.now_us() - began_us < 3_500_000
            assert seen == [LinkState.DEGRADED, LinkState.LOST]
            link.switch_on()
            assert await vehicle.until(lambda: vehicle.link_state is LinkState.CONNECTED, 2.0)

    virtual(main)


def test_a_link_that_loses_much_is_degraded(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            assert vehicle.telemetry().link is LinkState.CONNECTED
            link.loss = 0.4
            assert vehicle.telemetry().link is LinkState.DEGRADED

    virtual(main)


def test_a_wait_ends_by_the_clock(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (_, vehicle):
            began_us = clock.now_us()
            assert not await vehicle.until(lambda: False, 7.5)
            assert clock.now_us() - began_us == 7_500_000

    virtual(main)


def test_a_condition_that_raises_raises_where_it_is_waited_for(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):

            def condition() -> bool:
                if vehicle.state.custom_mode == 9:
                    raise ValueError("nine")
                return False

            link.custom_mode = 9
            with pytest.raises(ValueError, match="nine"):
                await vehicle.until(condition, 5.0)
            assert await vehicle.until(lambda: True)

    virtual(main)


def test_messages_are_asked_for_once_and_again_after_a_boot(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            await vehicle.sleep(20.0)
            first = intervals_asked(link)
            assert len(first) == len(set(first)) >= 11
            # Switched off and on so fast that no gap is seen; it streams nothing any more.
            link.intervals.clear()
            for fields in link.says.values():
                if "time_boot_ms" in fields:
                    fields["time_boot_ms"] = 1000
            assert await vehicle.until(lambda: vehicle.state.boots == 2, 30.0)
            await vehicle.sleep(5.0)
            assert set(link.intervals) == set(first)

    virtual(main)


def test_what_is_refused_is_not_asked_for_again_and_what_is_not_answered_is(virtual: Run) -> None:
    refused, lost = dialect.MAVLINK_MSG_ID_TERRAIN_REPORT, dialect.MAVLINK_MSG_ID_HOME_POSITION
    times: dict[int, int] = {}

    async def main(clock: Clock) -> None:
        link, vehicle = copter(clock)
        grant = link.obey[SET_INTERVAL]

        def obey(message: Any) -> int | None:
            id_ = int(message.param1)
            times[id_] = times.get(id_, 0) + 1
            if id_ == lost and times[id_] < 8:
                return None
            return DENIED if id_ == refused else grant(message)

        link.obey[SET_INTERVAL] = obey
        async with Playing((link, vehicle)):
            await vehicle.sleep(30.0)
            tried = times[refused]  # slower and slower, and then no more
            await vehicle.sleep(60.0)
            assert (times[refused], times[lost]) == (tried, 8)
            assert vehicle.state.home is not None

    virtual(main)


def test_a_home_that_is_not_streamed_is_asked_for_until_it_is_told(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        link, vehicle = copter(clock)
        home, grant = link.says.pop("HOME_POSITION"), link.obey[SET_INTERVAL]
        refused = dialect.MAVLINK_MSG_ID_HOME_POSITION
        link.obey[SET_INTERVAL] = lambda each: DENIED if each.param1 == refused else grant(each)
        asked: list[Any] = []

        def tell(message: Any) -> int:
            asked.append(message)
            if len(asked) < 3:
                return DENIED  # it has none yet
            link.hear(make("HOME_POSITION", **home))
            return ACCEPTED

        link.obey[dialect.MAV_CMD_REQUEST_MESSAGE] = tell
        async with Playing((link, vehicle)):
            assert await vehicle.until(lambda: vehicle.state.home is not None, 30.0)
            await vehicle.sleep(30.0)
            assert [each.param1 for each in asked] == [refused] * 3

    virtual(main)


def test_its_last_texts_are_kept_for_a_while(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            link.say("PreArm: Compass not healthy")
            await vehicle.sleep(3.0)
            link.say("EKF3 IMU0 is using GPS")
            assert vehicle.recent_texts(2.0) == ("EKF3 IMU0 is using GPS",)
            assert len(vehicle.recent_texts(5.0)) == 2

    virtual(main)


def test_operators_read_what_an_autopilot_warns_of_and_not_every_half_minute(
    virtual: Run, caplog: pytest.LogCaptureFixture
) -> None:
    def says(text: str, severity: int) -> Any:
        return make("STATUSTEXT", text=text.encode(), severity=severity)

    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, _):
            for _ in range(12):
                link.hear(says("Battery 1 is low 10.2V", dialect.MAV_SEVERITY_WARNING))
                link.hear(says("Mission: 2 WP", dialect.MAV_SEVERITY_NOTICE))
                await clock.sleep(30.0)

    virtual(main)
    warned = [each.getMessage() for each in caplog.records if each.levelno == logging.WARNING]
    assert warned == ["uav1 says: Battery 1 is low 10.2V"] * 2


def test_operators_read_a_warning_in_several_messages_once_also_where_its_end_is_lost(
    virtual: Run, caplog: pytest.LogCaptureFixture
) -> None:
    denied = "Arming denied: Resolve system health failures first"
    lost = "Preflight Fail: the sensors of this vehicle disagree, and its end is lost"

    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, _):
            for text, id_, chunks in ((denied, 0, 2), (lost, 1, 1)):
                for n in range(chunks):
                    chunk = text[50 * n : 50 * n + 50].encode()
                    fields = {"text": chunk, "severity": dialect.MAV_SEVERITY_WARNING}
                    link.hear(make("STATUSTEXT", id=id_, chunk_seq=n, **fields))
                await clock.sleep(5.0)

    virtual(main)
    warned = [each.getMessage() for each in caplog.records if each.levelno == logging.WARNING]
    assert warned == [f"uav1 says: {denied}", f"uav1 says: {lost[:50].strip()}..."]


def test_operators_read_what_a_vehicle_waits_for_before_it_is_armed(
    virtual: Run, caplog: pytest.LogCaptureFixture
) -> None:
    async def main(clock: Clock) -> None:
        link, vehicle = copter(clock)
        ready = link.says["EKF_STATUS_REPORT"]
        link.says["EKF_STATUS_REPORT"] = {"flags": 0xA7}
        link.says["GPS_RAW_INT"] = {"fix_type": 1}
        async with Playing((link, vehicle)):
            arming = asyncio.get_running_loop().create_task(vehicle.driver.arm())
            await clock.sleep(10.0)
            link.says["GPS_RAW_INT"] = {"fix_type": 6}
            await clock.sleep(20.0)
            link.says["EKF_STATUS_REPORT"] = ready
            await arming

    virtual(main)
    warned = [each.getMessage() for each in caplog.records if each.levelno == logging.WARNING]
    assert warned == [
        "uav1 waits until it is ready: GPS: no 3D fix; EKF: no position yet",
        "uav1 waits until it is ready: EKF: no position yet",
        "uav1 is ready",
    ]
