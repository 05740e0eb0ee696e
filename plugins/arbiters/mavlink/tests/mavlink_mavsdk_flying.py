"""Simulated autopilots as a program sees them that knows MAVSDK 4 and nothing else."""

import asyncio
import json
from collections.abc import AsyncIterator, Callable
from contextlib import aclosing, asynccontextmanager
from typing import Any

from m2pem_plugin_mavlink.simulator.simulator import SimulatedVehicle, Simulator
from m2pem_plugin_mavlink.simulator.specification import Kind, VehicleSpec
from mavlink_mavsdk_world import free_port
from mavsdk import logging as mavsdk_log
from mavsdk.asyncio import Configuration, Mavsdk
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.gimbal import GimbalAsync
from mavsdk.asyncio.plugins.info import InfoAsync
from mavsdk.asyncio.plugins.mavlink_direct import MavlinkDirectAsync, MavlinkMessage
from mavsdk.asyncio.plugins.mission_raw import MissionRawAsync
from mavsdk.asyncio.plugins.offboard import OffboardAsync
from mavsdk.asyncio.plugins.param import ParamAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.component_type import ComponentType
from pymavlink.dialects.v20 import ardupilotmega as dialect

WITHIN_S = 40.0
SPEED = 20.0
GUIDED = {Kind.COPTER: 4, Kind.ROVER: 15}


class Flown:
    """A vehicle: MAVSDK's plugins for it, and what is true (`real`)."""

    def __init__(self, system: Any, real: SimulatedVehicle) -> None:
        self.system = system
        self.real = real
        self.action = ActionAsync(system)
        self.direct = MavlinkDirectAsync(system)
        self.info = InfoAsync(system)
        self.missions = MissionRawAsync(system)
        self.offboard = OffboardAsync(system)
        self.param = ParamAsync(system)
        self.telemetry = TelemetryAsync(system)
        self._gimbal: GimbalAsync | None = None

    @property
    def gimbal(self) -> GimbalAsync:
        if self._gimbal is None:
            self._gimbal = GimbalAsync(self.system)
        return self._gimbal

    def release(self) -> None:
        plugins = [self.action, self.direct, self.info, self.missions, self.offboard, self.param]
        for plugin in (*plugins, self.telemetry, self._gimbal):
            if plugin is not None:
                plugin.destroy()

    async def command(self, command: int, *params: float) -> int:
        """A command that MAVSDK has no method for; its MAV_RESULT."""
        given = {f"param{number}": value for number, value in enumerate(params, 1)}
        target = {"target_system": await self.system.get_system_id(), "target_component": 1}
        fields = json.dumps({**target, "command": command, **given})
        ack = await self.direct.send_command(MavlinkMessage("COMMAND_LONG", fields_json=fields))
        return int(json.loads(ack.fields_json)["result"])

    async def ready(self) -> None:
        """Wait until its estimator uses the GPS: MAVSDK calls an ArduPilot healthy before that."""
        ekf = dialect.MAVLINK_MSG_ID_EKF_STATUS_REPORT
        await self.command(dialect.MAV_CMD_SET_MESSAGE_INTERVAL, ekf, 200_000)
        await first(
            self.direct.subscribe_message("EKF_STATUS_REPORT"),
            lambda each: json.loads(each.fields_json)["flags"] & dialect.EKF_POS_HORIZ_ABS,
        )

    async def guided(self) -> None:
        """ArduPilot is armed in the mode in which it will be driven."""
        custom = dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        number = GUIDED[self.real.autopilot.spec.kind]
        assert await self.command(dialect.MAV_CMD_DO_SET_MODE, custom, number) == 0

    async def up(self, altitude_m: float) -> None:
        """Take off."""
        await self.ready()
        await self.action.set_takeoff_altitude(altitude_m)
        await self.guided()
        await self.action.arm()
        await self.action.takeoff()
        await really(lambda: self.real.up_m > altitude_m - 0.5)


async def first(stream: Any, true: Callable[[Any], bool] = lambda _: True) -> Any:
    """The first of a subscription for which something is true."""
    async with asyncio.timeout(WITHIN_S), aclosing(stream) as values:
        async for value in values:
            if true(value):
                return value


async def really(true: Callable[[], bool], within_s: float = WITHIN_S) -> None:
    """Wait until it is so in truth."""
    async with asyncio.timeout(within_s):
        while not true():  # noqa: ASYNC110  # the simulation has no event for it
            await asyncio.sleep(0.01)


@asynccontextmanager
async def flying(*specs: VehicleSpec, speed: float = SPEED) -> AsyncIterator[dict[int, Flown]]:
    """Vehicles, by their system ids, that MAVSDK has found."""
    mavsdk_log.log_subscribe(lambda *_: True)
    port = free_port()
    async with Simulator(specs, speed=speed, to=("127.0.0.1", port)) as simulator:
        kind = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
        mavsdk, found = Mavsdk(kind), {}
        try:
            await mavsdk.add_any_connection(f"udpin://127.0.0.1:{port}")
            async with asyncio.timeout(WITHIN_S):
                while len(found) < len(specs):
                    for system in await mavsdk.get_systems():
                        id_ = await system.get_system_id()
                        if id_ not in found and await system.has_autopilot():
                            found[id_] = Flown(system, simulator[id_])
                    await asyncio.sleep(0.02)
            yield found
        finally:
            for flown in found.values():
                flown.release()
            mavsdk.destroy()
