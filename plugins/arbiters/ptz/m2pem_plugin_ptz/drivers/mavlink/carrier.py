"""The vehicle that carries a camera, as the camera's orders need it."""

import math

from m2pem.api import FleetBus, ResourceId, VehicleState
from m2pem_plugin_ptz.drivers.mavlink import level
from m2pem_plugin_ptz.drivers.mavlink.level import Direction


class Carrier:
    """What was heard last of it. `stabilized`: directions are said from the horizon already."""

    def __init__(self, vehicle: ResourceId, bus: FleetBus, *, stabilized: bool) -> None:
        self._vehicle = vehicle
        self._bus = bus
        self._stabilized = stabilized

    @property
    def heading_rad(self) -> float | None:
        """From true north, clockwise; None: not known."""
        yaw_rad = self._state.yaw_rad if self._state is not None else None
        return None if yaw_rad is None else math.remainder(math.pi / 2 - yaw_rad, math.tau)

    def from_horizon(self, direction: Direction) -> Direction:
        """What is meant as the camera is mounted, for a gimbal that is level."""
        state = self._state
        if self._stabilized or state is None:
            return direction
        return level.from_deck(direction, state.roll_rad, state.pitch_rad)

    def from_deck(self, direction: Direction) -> Direction:
        """Where a gimbal that is level points, as the camera is mounted."""
        state = self._state
        if self._stabilized or state is None:
            return direction
        return level.to_deck(direction, state.roll_rad, state.pitch_rad)

    @property
    def _state(self) -> VehicleState | None:
        state = self._bus.latest(self._vehicle)
        return state if isinstance(state, VehicleState) else None
