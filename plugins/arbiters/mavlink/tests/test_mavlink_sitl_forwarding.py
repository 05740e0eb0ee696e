"""A real ArduCopter behind an executive that forwards it: MAVSDK flies it only where the fleet lets
commands through."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import aclosing, asynccontextmanager
from pathlib import Path
from typing import Any

import mavlink_sitl as sitl
import pytest
from mavlink_gcs import gateway
from mavlink_mavsdk_world import free_port
from mavsdk import logging as mavsdk_log
from mavsdk.asyncio import ComponentType, Configuration, Mavsdk
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.plugins.action import ActionError

from m2pem.api import MissionControl

pytestmark = [
    pytest.mark.sitl,
    pytest.mark.skipif(
        sitl.program("M2PEM_ARDUCOPTER") is None, reason="M2PEM_ARDUCOPTER names no program"
    ),
]

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


def test_mavsdk_takes_arducopter_off_through_m2pem_where_it_is_let(tmp_path: Path) -> None:
    async def main() -> None:
        async with flown(tmp_path, forward_commands=["uav1"]) as (_, action, telemetry):
            await action.set_takeoff_altitude(8.0)
            await action.arm()
            await action.takeoff()
            await first(telemetry.subscribe_position(), lambda each: each.relative_altitude_m > 5.0)

    asyncio.run(main())
