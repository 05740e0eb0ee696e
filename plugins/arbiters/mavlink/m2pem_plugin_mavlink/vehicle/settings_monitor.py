"""Tells operators that a vehicle's home or one of its important parameters was changed.

m2pem changes neither: another ground station, or a pilot, did. An autopilot broadcasts PARAM_VALUE
when a parameter is set, and also answers the requests of others with it; so values are compared
with those that were read before.
"""

import asyncio
import math

from m2pem.api import GeoPosition, distance_m
from m2pem_plugin_mavlink.microservices.parameters import (
    PARAM_VALUE,
    ReadParameter,
    encoded_name,
    value_of,
)
from m2pem_plugin_mavlink.protocol.messages import Address, Message
from m2pem_plugin_mavlink.protocol.transaction import ExchangeError
from m2pem_plugin_mavlink.vehicle.failsafe import parameters_of_interest
from m2pem_plugin_mavlink.vehicle.identity import Firmware, Identity, Kind
from m2pem_plugin_mavlink.vehicle.vehicle import Vehicle

MOVED_M = 2.0
"""Homes differ by less when autopilots set them again."""

ARMING_S = 3.0
"""Autopilots set home when they are armed."""

FAR_M = 15.0
AVOIDANCE = "OA_TYPE"
_FENCE = ("FENCE_ENABLE", "FENCE_ACTION", "FENCE_TYPE")
_NAMES = {
    Kind.COPTER: (AVOIDANCE, "WPNAV_SPEED", "WP_SPD", "RTL_ALT", "RTL_ALT_M", *_FENCE),
    Kind.ROVER: (AVOIDANCE, "CRUISE_SPEED", "WP_SPEED", *_FENCE),
    Kind.BOAT: (AVOIDANCE, "CRUISE_SPEED", "WP_SPEED", *_FENCE),
    Kind.PLANE: ("AIRSPEED_CRUISE", "RTL_ALTITUDE", "RTL_AUTOLAND", *_FENCE),
}
_PX4 = ("MPC_XY_CRUISE", "RTL_RETURN_ALT", "GF_ACTION", "GF_MAX_VER_DIST", "GF_MAX_HOR_DIST")


def _watched(identity: Identity) -> tuple[str, ...]:
    own = _PX4 if identity.firmware is Firmware.PX4 else _NAMES.get(identity.kind, _FENCE)
    return tuple(dict.fromkeys((*own, *parameters_of_interest(identity))))


class SettingsMonitor:
    """Watches one vehicle between `open` and `close`."""

    def __init__(self, vehicle: Vehicle) -> None:
        self._vehicle = vehicle
        self._values: dict[str, float] = {}
        self._names: dict[bytes, str] = {}
        self._home: GeoPosition | None = None
        self._armed_s: float | None = None
        self._tasks: list[asyncio.Task[None]] = []

    def open(self) -> None:
        self._tasks = [asyncio.get_running_loop().create_task(self._read())]

    async def close(self) -> None:
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _read(self) -> None:
        """Read the parameters once; a vehicle does not have all of them."""
        vehicle = self._vehicle
        await vehicle.until(lambda: vehicle.identity is not None)
        assert vehicle.identity is not None
        encoding, link = vehicle.identity.firmware.encoding, vehicle.link
        self._names = {encoded_name(each): each for each in _watched(vehicle.identity)}

        def receive(message: Message, sender: Address) -> None:
            name = self._names.get(message.param_id)
            if name is not None and sender == link.address:
                self._take(name, value_of(message, encoding))

        stop_listening = link.listen((PARAM_VALUE,), receive)
        try:
            for name in self._names.values():
                if name not in self._values:
                    try:
                        await link.perform(ReadParameter(link.address, name, encoding))
                    except ExchangeError:
                        continue
            await vehicle.until(lambda: False)
        finally:
            stop_listening()

    def _take(self, name: str, value: float) -> None:
        if math.isnan(value):
            return
        before = self._values.get(name)
        self._values[name] = value
        if name == AVOIDANCE:
            self._vehicle.avoids_obstacles = value != 0
        if before is not None and not math.isclose(before, value, rel_tol=1e-5):
            self._vehicle.warn(f"parameter {name} was set from {before:g} to {value:g}")

    def look_at_home(self) -> None:
        """Compare its home with the one before; called whenever a message was received."""
        state, now_s = self._vehicle.state, self._vehicle.link.now_s()
        if not state.armed:
            self._armed_s = None
        elif self._armed_s is None:
            self._armed_s = now_s
        home, before = state.home, self._home or state.home
        if home is None or before is None:
            return
        self._home = before
        moved_m = distance_m(before.latlon, home.latlon)
        raised_m = home.altitude_m - before.altitude_m
        if moved_m < MOVED_M and abs(raised_m) < MOVED_M:
            return  # small steps add up to a move
        self._home = home
        settled, here = self._armed_s is not None, state.position
        if self._armed_s is None or now_s - self._armed_s < ARMING_S:
            settled = here is not None and distance_m(here.latlon, home.latlon) > FAR_M
        if settled:
            self._vehicle.warn(
                f"its home was moved by {moved_m:.0f} m and {raised_m:+.0f} m in height, to "
                f"{home.latitude_deg:.6f}, {home.longitude_deg:.6f}: it returns there, and heights "
                "above home count from there"
            )
