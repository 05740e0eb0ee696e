"""Waits until the vehicles of a fleet may be armed, on the ports that the executive will use."""

import asyncio
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import AsyncExitStack, asynccontextmanager

from m2pem.api import LinkState, SystemClock
from m2pem.errors import M2pemError, PluginError
from m2pem_plugin_mavlink.link.routed_link import GROUND_STATION, open_link
from m2pem_plugin_mavlink.protocol.messages import Address
from m2pem_plugin_mavlink.sitl import fleet
from m2pem_plugin_mavlink.vehicle.driver import FlightMode
from m2pem_plugin_mavlink.vehicle.readiness import unlocated
from m2pem_plugin_mavlink.vehicle.vehicle import Vehicle

READY_WITHIN_S = 300.0
REPORT_EVERY_S = 5.0
LOOK_EVERY_S = 0.2
LOST_AFTER_S = 10.0
"""Seconds of simulated time after which a silent program is not ready."""

HIGHEST_SYSTEM = 255


class NotReadyError(M2pemError):
    """Started vehicles do not become ready; the text gives the reason."""


@asynccontextmanager
async def connected(
    vehicles: Sequence[fleet.Vehicle], speed: float
) -> AsyncIterator[list[Vehicle]]:
    """Listen on the ports of the fleet, as the executive will, until the end of the block.

    m2pem uses another system id than the executive here: ArduPilot's failsafe monitors the
    heartbeats of the executive alone, and must not detect their loss before the executive has
    started.

    Raises:
        PluginError: a port is in use.
    """
    taken = {each.settings.system_id for each in vehicles}
    taken |= {each.settings.gcs_system_id for each in vehicles}
    own = max(set(range(1, HIGHEST_SYSTEM + 1)) - taken)
    source = Address(own, GROUND_STATION.component)
    clock = SystemClock(speed)
    async with AsyncExitStack() as opened:
        found: list[Vehicle] = []
        for each in vehicles:
            address = Address(each.settings.system_id, each.settings.component_id)
            try:
                link = await open_link(address, each.settings.urls, clock, source)
            except PluginError as error:
                raise PluginError(
                    f"{each.resource}: connection.url: {error}; an executive is started after "
                    "`m2pem sitl` has printed ready"
                ) from error
            opened.push_async_callback(link.close)
            vehicle = Vehicle(each.resource, each.domain, link, clock, lost_after_s=LOST_AFTER_S)
            opened.push_async_callback(vehicle.close)
            vehicle.open()
            found.append(vehicle)
        yield found


async def ready(vehicles: Sequence[Vehicle], report: Callable[[str], None]) -> None:
    """Wait until all vehicles may be armed; `report` is called every few seconds with the reasons.

    Raises:
        NotReadyError: they do not become ready in time.
    """
    loop = asyncio.get_running_loop()
    began_s = reported_s = loop.time()
    while waiting := _waiting(vehicles):
        now_s = loop.time()
        if now_s - began_s > READY_WITHIN_S:
            raise NotReadyError(f"not ready after {READY_WITHIN_S:.0f} s: {waiting}")
        if now_s - reported_s > REPORT_EVERY_S:
            reported_s = now_s
            report(f"waiting for {waiting}")
        await asyncio.sleep(LOOK_EVERY_S)


def _waiting(vehicles: Sequence[Vehicle]) -> str:
    """Return which vehicles may not be armed, with the reasons; "" if all may."""
    reasons = {each.resource: _reasons(each) for each in vehicles}
    return "; ".join(f"{name}: {why}" for name, why in reasons.items() if why)


def _reasons(vehicle: Vehicle) -> str:
    if vehicle.identity is None:
        return "no heartbeat yet"
    if vehicle.link_state is LinkState.LOST:
        return f"silent for {vehicle.silent_s or 0.0:.0f} s"
    if vehicle.state.mode is FlightMode.RETURN:
        # A plane counts its ground station as lost from the start, and waits in RTL, in which it
        # cannot be armed. The executive's takeoff leaves that mode.
        return ", ".join(unlocated(vehicle.identity.firmware, vehicle.state, vehicle.link.now_s()))
    readiness = vehicle.driver.readiness()
    return "" if readiness.ready else ", ".join(readiness.reasons)
