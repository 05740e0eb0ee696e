"""The context of the parts of a MAVLink camera, and the rotation between mount and horizon.

MAVLink gimbals are level whatever the vehicle does, and are commanded so. `roll_rad` and
`pitch_rad` are those of a VehicleState (REP-103): roll is positive when the right side is down,
pitch when the nose is down.
"""

import logging
import math
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from m2pem.api import Clock, FleetBus, ResourceId, VehicleState
from m2pem_plugin_ptz.drivers.mavlink.settings import MavlinkSettings
from m2pem_plugin_ptz.gimbal import Reach

if TYPE_CHECKING:
    from m2pem_plugin_mavlink import VehicleLink


Job: TypeAlias = Callable[[], Awaitable[None]]

Direction = tuple[float, float]
"""Pan, clockwise from the vehicle's heading, and tilt upwards, in radians."""


def deck_to_horizon(direction: Direction, roll_rad: float, pitch_rad: float) -> Direction:
    """Return a direction of the deck from the horizon."""
    x, y, z = _vector(direction)
    y, z = _turned(y, z, roll_rad)
    z, x = _turned(z, x, pitch_rad)
    return _direction(x, y, z)


def horizon_to_deck(direction: Direction, roll_rad: float, pitch_rad: float) -> Direction:
    """Return a direction of the horizon from the deck."""
    x, y, z = _vector(direction)
    z, x = _turned(z, x, -pitch_rad)
    y, z = _turned(y, z, -roll_rad)
    return _direction(x, y, z)


def _vector(direction: Direction) -> tuple[float, float, float]:
    """Return forward, left, up."""
    pan, tilt = direction
    return math.cos(tilt) * math.cos(pan), -math.cos(tilt) * math.sin(pan), math.sin(tilt)


def _direction(x: float, y: float, z: float) -> Direction:
    return math.atan2(-y, x), math.asin(max(-1.0, min(1.0, z)))


def _turned(first: float, second: float, angle_rad: float) -> tuple[float, float]:
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    return cos * first - sin * second, sin * first + cos * second


class VehicleAttitude:
    """The last attitude of the camera's vehicle. `stabilized`: directions are from the horizon
    already."""

    def __init__(self, vehicle: ResourceId, bus: FleetBus, *, stabilized: bool) -> None:
        self._vehicle = vehicle
        self._bus = bus
        self._stabilized = stabilized

    @property
    def heading_rad(self) -> float | None:
        """From true north, clockwise; None if it is not known."""
        yaw_rad = self._state.yaw_rad if self._state is not None else None
        return None if yaw_rad is None else math.remainder(math.pi / 2 - yaw_rad, math.tau)

    def to_horizon(self, direction: Direction) -> Direction:
        """Return the direction of a level gimbal for a direction of the mount."""
        state = self._state
        if self._stabilized or state is None:
            return direction
        return deck_to_horizon(direction, state.roll_rad, state.pitch_rad)

    def to_mount(self, direction: Direction) -> Direction:
        """Return the direction of the mount for a direction of a level gimbal."""
        state = self._state
        if self._stabilized or state is None:
            return direction
        return horizon_to_deck(direction, state.roll_rad, state.pitch_rad)

    @property
    def _state(self) -> VehicleState | None:
        state = self._bus.latest(self._vehicle)
        return state if isinstance(state, VehicleState) else None


@dataclass(frozen=True, slots=True)
class CameraContext:
    """The context of the parts of a camera. `reach` is that of the fleet. `on_contact` is called
    with each message that shows that the part is there."""

    resource: ResourceId
    settings: MavlinkSettings
    reach: Reach
    attitude: VehicleAttitude
    link: "VehicleLink"
    clock: Clock
    logger: logging.Logger
    on_contact: Callable[[], None]

    def now_s(self) -> float:
        return self.clock.now_us() / 1e6

    async def carefully(self, part: str, job: Job) -> None:
        """Do a job. That the part refuses it, or does not answer, is logged."""
        from m2pem_plugin_mavlink import ExchangeError  # noqa: PLC0415  # optional

        try:
            await job()
        except ExchangeError as error:
            self.logger.warning("%s: %s: %s", self.resource, part, error)
