"""Real autopilots behind an executive that forwards them: other ground stations command them only
where the fleet lets commands through, and then they have precedence."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import aclosing, asynccontextmanager
from pathlib import Path
from typing import Any

import mavlink_sitl as sitl
import pytest
from mavlink_gcs import gateway, ground_station
from mavlink_mavsdk_world import free_port
from mavsdk import logging as mavsdk_log
from mavsdk.asyncio import ComponentType, Configuration, Mavsdk
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.plugins.action import ActionError
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import MissionControl
from m2pem.testing import scenarios

pytestmark = pytest.mark.sitl("M2PEM_ARDUCOPTER", "M2PEM_ARDUROVER")

WITHIN_S = 120.0

FLEET = """
version: 1
origin: {{lat: 47.397742, lon: 8.545594, alt: 488.0}}
vehicles:
  uav1:
    domain: air
    arbiter: mavlink
    sitl: true
    lost_after: 60 s
    connection: {{url: "udpin://127.0.0.1:{port}", system_id: 1}}
"""


@asynccontextmanager
async def flown(
    folder: Path, **settings: Any
) -> AsyncIterator[tuple[MissionControl, ActionAsync, TelemetryAsync]]:
    """ArduCopter, an executive in the middle, and MAVSDK at the other end."""
    binary = sitl.program("M2PEM_ARDUCOPTER")
    assert binary is not None
    port, ground = free_port(), free_port()
    mavsdk_log.log_subscribe(lambda *_: True)
    with sitl.running([sitl.ardupilot(binary, "quad", 0, port)], folder):
        fleet = FLEET.format(port=port)
        url = f"udpout://127.0.0.1:{ground}"
        async with gateway(
            folder, speed=sitl.SPEED, fleet=fleet, url=url, forward="all", **settings
        ) as (control, _):
            await ready(control)
            mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
            await mavsdk.add_any_connection(f"udpin://127.0.0.1:{ground}")
            system = await mavsdk.first_autopilot(WITHIN_S)
            assert system is not None
            action, telemetry = ActionAsync(system), TelemetryAsync(system)
            try:
                yield control, action, telemetry
            finally:
                action.destroy()
                telemetry.destroy()
                await asyncio.to_thread(mavsdk.destroy)


async def ready(control: MissionControl) -> None:
    async with asyncio.timeout(WITHIN_S):
        async for state in control.telemetry():
            if getattr(state, "ready", None):
                return


async def first(stream: Any, true: Callable[[Any], bool]) -> Any:
    async with asyncio.timeout(WITHIN_S), aclosing(stream):
        async for value in stream:
            if true(value):
                return value


def test_mavsdk_sees_arducopter_through_m2pem_and_may_not_arm_it(tmp_path: Path) -> None:
    async def main() -> None:
        async with flown(tmp_path) as (_, action, telemetry):
            position = await first(telemetry.subscribe_position(), lambda _: True)
            assert abs(position.latitude_deg - sitl.HOME[0]) < 1e-4
            with pytest.raises(ActionError):
                await action.arm()
            assert not await first(telemetry.subscribe_armed(), lambda _: True)

    asyncio.run(main())


@pytest.mark.tried_with(
    "MAVSDK",
    "commands ArduCopter through the MAVLink face",
    kind="MAVLink clients",
    result="takes off where the fleet lets it",
    package="mavsdk",
    on="2026-11",
)
def test_mavsdk_takes_arducopter_off_through_m2pem_where_it_is_let(tmp_path: Path) -> None:
    async def main() -> None:
        async with flown(tmp_path, forward_commands=["uav1"]) as (_, action, telemetry):
            await action.set_takeoff_altitude(8.0)
            await action.arm()
            await action.takeoff()
            await first(telemetry.subscribe_position(), lambda each: each.relative_altitude_m > 5.0)

    asyncio.run(main())


@pytest.mark.parametrize("moment", ["in GUIDED", "armed"])
def test_who_stops_ardurover_while_m2pem_prepares_a_goto_is_not_overridden(
    tmp_path: Path, moment: str
) -> None:
    async def main() -> None:
        binary = sitl.program("M2PEM_ARDUROVER")
        assert binary is not None
        port = free_port()
        fleet = FLEET.format(port=port).replace("uav1", "ugv1").replace("air", "ground")
        rover, hold, guided, armed = 1, 4, 15, dialect.MAV_MODE_FLAG_SAFETY_ARMED
        so_far: Callable[[Any], bool] = {
            "in GUIDED": lambda beat: beat.custom_mode == guided,
            "armed": lambda beat: bool(beat.base_mode & armed),
        }[moment]

        def is_rover(message: Any) -> bool:
            return (message.get_srcSystem(), message.get_srcComponent()) == (rover, 1)

        with sitl.running([sitl.ardupilot(binary, "rover", 0, port)], tmp_path):
            async with (
                gateway(
                    tmp_path,
                    speed=sitl.SPEED,
                    fleet=fleet,
                    forward="all",
                    forward_commands="all",
                ) as (control, own),
                ground_station(own) as station,
            ):
                await ready(control)
                since = len(station.received)
                far = f"[{sitl.HOME[0] + 0.003}, {sitl.HOME[1]}]"
                run = await control.start(scenarios.one_behavior("goto", "ugv1", target=far))
                await station.hears("HEARTBEAT", lambda m: is_rover(m) and so_far(m), since)
                mode = dialect.MAV_CMD_DO_SET_MODE
                assert await station.command(rover, mode, 1, hold) == dialect.MAV_RESULT_ACCEPTED
                async with asyncio.timeout(WITHIN_S):
                    summary = await control.wait(run)
                assert "TAKEN_OVER" in summary.detail
                assert "HOLD" in summary.detail
                for _ in range(3):
                    beat = await station.hears("HEARTBEAT", is_rover, len(station.received))
                    assert beat.custom_mode == hold

    asyncio.run(main())
