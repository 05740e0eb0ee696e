"""Looks at the vehicles of a fleet over ROS, without a command, for `m2pem doctor`."""

import asyncio
import logging
from collections.abc import Mapping, Sequence

from m2pem.api import (
    ArbiterContext,
    Connection,
    Fleet,
    HealthCheck,
    HealthStatus,
    PayloadState,
    ResourceId,
    SystemClock,
)
from m2pem_plugin_ros.connections import ConnectionsSetup, DdsConnections, VehicleConnection
from m2pem_plugin_ros.onboard.target_bus import TargetBus
from m2pem_plugin_ros.settings import read_settings

LOOK_S = 1.5
"""DDS needs some of it for discovery."""

SEARCH_S = 1.0
LOOK_EVERY_S = 0.1

REMEDY = "m2pem does not command it like that: docs/ros.md, A vehicle that m2pem cannot use"


async def check_vehicles(fleet: Fleet) -> Sequence[HealthCheck]:
    """Return for each vehicle of this host whether it is there, and whether it could be
    commanded."""
    connections = {
        vehicle.id: Connection.of(fleet, vehicle.id)
        for vehicle in fleet.vehicles.values()
        if vehicle.arbiter == "ros" and not vehicle.host
    }
    logger = logging.Logger("doctor")
    logger.addHandler(logging.NullHandler())  # what is wrong is in the checks
    context = ArbiterContext(SystemClock(), TargetBus(), logger, fleet.origin)
    setup = ConnectionsSetup(connections, read_settings(connections), {}, context, _ignore)
    made = DdsConnections(setup)
    vehicles = await made.open()
    try:
        await _until_there(vehicles)
        absent = [each for each, found in vehicles.items() if not found.endpoints.is_listed]
        if absent:
            await made.search(absent, SEARCH_S)
        return [_check(resource, found) for resource, found in vehicles.items()]
    finally:
        await made.close()


def _ignore(_: PayloadState) -> None:
    return


async def _until_there(vehicles: Mapping[ResourceId, VehicleConnection]) -> None:
    loop = asyncio.get_running_loop()
    until_s = loop.time() + LOOK_S
    while loop.time() < until_s:
        if all(
            each.sensors.localization.pose is not None and not each.refusal
            for each in vehicles.values()
        ):
            return
        await asyncio.sleep(LOOK_EVERY_S)


def _check(resource: ResourceId, found: VehicleConnection) -> HealthCheck:
    name, sensors, endpoints = f"ros {resource}", found.sensors, found.endpoints
    if wrong := found.refusal:
        return HealthCheck(name, HealthStatus.ERROR, wrong, REMEDY)
    if not endpoints.is_listed:
        return HealthCheck(name, HealthStatus.WARNING, endpoints.absence, "is the vehicle started?")
    if problems := (*sensors.errors, *sensors.problems):
        return HealthCheck(name, HealthStatus.WARNING, "; ".join(problems))
    return HealthCheck(name, HealthStatus.OK, "it is there, with one publisher of each topic")
