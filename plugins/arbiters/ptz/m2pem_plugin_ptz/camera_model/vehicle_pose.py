"""The pose of a vehicle, predicted from its last states: of the camera's vehicle, and of
targets."""

import math
from dataclasses import dataclass

import numpy as np

from m2pem.api import ArbiterContext, ResourceId, VehicleState
from m2pem_plugin_ptz.camera_model.frames import Vector, ecef, enu_of_ecef, geodetic
from m2pem_plugin_ptz.camera_model.pose import VehiclePose

AHEAD_S = 1.0
"""A vehicle without a new state for longer counts as stopped there."""

_SHORTEST_S, _LONGEST_S = 0.02, 1.5
"""Two states between these times apart give the turn rates."""


@dataclass(frozen=True, slots=True)
class AttitudeRates:
    """Roll, pitch and yaw rates in rad/s, with the signs of `VehicleState`."""

    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0


class TrackedVehicle:
    """One vehicle on the bus. It reads the bus when it is called, so call it often."""

    def __init__(self, vehicle: ResourceId, domain: str, context: ArbiterContext) -> None:
        self.vehicle = vehicle
        self._domain = domain
        self._context = context
        self._newest: VehicleState | None = None
        self._rates = AttitudeRates()

    def state(self) -> VehicleState | None:
        """Return the newest state."""
        state = self._context.bus.latest(self.vehicle)
        if isinstance(state, VehicleState) and state is not self._newest:
            if self._newest is None or state.time_us > self._newest.time_us:
                self._rates = _rates(self._newest, state)
            self._newest = state
        return self._newest

    def attitude(self, at_us: int) -> tuple[float, float, float | None]:
        """Return roll, pitch and yaw at a near time; yaw None if it is not known."""
        state = self.state()
        if state is None:
            return 0.0, 0.0, None
        ahead_s = self._ahead_s(state, at_us)
        yaw = state.yaw_rad
        return (
            state.roll_rad + self._rates.roll * ahead_s,
            state.pitch_rad + self._rates.pitch * ahead_s,
            None if yaw is None else yaw + self._rates.yaw * ahead_s,
        )

    def place_ecef(self, at_us: int) -> Vector | None:
        """Return the position in ECEF at a near time; None if it is not known."""
        state = self.state()
        if state is None or state.position is None:
            return None
        place_ecef = ecef(state.position)
        if state.velocity_enu_m_s is None:
            return place_ecef
        gone = np.array(state.velocity_enu_m_s) * self._ahead_s(state, at_us)
        moved: Vector = place_ecef + enu_of_ecef(state.position).T @ gone
        return moved

    def pose(self, at_us: int) -> VehiclePose | None:
        """Return the pose at a near time; None if position or heading is not known."""
        place_ecef = self.place_ecef(at_us)
        roll, pitch, yaw = self.attitude(at_us)
        if place_ecef is None or yaw is None:
            return None
        return VehiclePose(geodetic(place_ecef), yaw, roll, pitch)

    def home_altitude_m(self) -> float:
        """Return the altitude of its home, from which relative altitudes count."""
        state = self.state()
        if state is None or state.position is None or state.altitude_above_home_m is None:
            return self._context.origin[2]
        return state.position.altitude_m - state.altitude_above_home_m

    def ground_m(self) -> float:
        """Return the altitude of the ground: that of a vehicle on land or water; otherwise that of
        its home."""
        state = self.state()
        if self._domain in ("ground", "surface") and state is not None and state.position:
            return state.position.altitude_m
        return self.home_altitude_m()

    def missing(self) -> str:
        """Return what is not known of the pose; "" if all is."""
        state = self.state()
        if state is None or state.position is None:
            return f"the position of {self.vehicle} is not known"
        if state.yaw_rad is None:
            return f"the heading of {self.vehicle} is not known"
        return ""

    @staticmethod
    def _ahead_s(state: VehicleState, at_us: int) -> float:
        return min(max((at_us - state.time_us) / 1e6, 0.0), AHEAD_S)


def _rates(before: VehicleState | None, after: VehicleState) -> AttitudeRates:
    if before is None:
        return AttitudeRates()
    apart_s = (after.time_us - before.time_us) / 1e6
    if not _SHORTEST_S <= apart_s <= _LONGEST_S:
        return AttitudeRates()
    yaw = 0.0
    if before.yaw_rad is not None and after.yaw_rad is not None:
        yaw = math.remainder(after.yaw_rad - before.yaw_rad, math.tau)
    return AttitudeRates(
        math.remainder(after.roll_rad - before.roll_rad, math.tau) / apart_s,
        math.remainder(after.pitch_rad - before.pitch_rad, math.tau) / apart_s,
        yaw / apart_s,
    )
