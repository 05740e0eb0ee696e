"""Where vehicles are between what they say: of the camera's own vehicle, and of targets."""

import math
from dataclasses import dataclass

import numpy as np

from m2pem.api import ArbiterContext, ResourceId, VehicleState
from m2pem_plugin_ptz.camera_model.frames import Vector, ecef, enu_of_ecef, geodetic
from m2pem_plugin_ptz.camera_model.pose import Stance

AHEAD_S = 1.0
"""A vehicle that says nothing new for longer is taken to have stopped there."""

_SHORTEST_S, _LONGEST_S = 0.02, 1.5
"""Between these, two states tell how fast a vehicle turns."""


@dataclass(frozen=True, slots=True)
class Rates:
    """How fast a vehicle rolls, pitches and turns, in rad/s, in the sense of `VehicleState`."""

    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0


class Carrier:
    """One vehicle, as it was heard on the bus. Ask it often: it looks when it is asked."""

    def __init__(self, vehicle: ResourceId, domain: str, context: ArbiterContext) -> None:
        self.vehicle = vehicle
        self._domain = domain
        self._context = context
        self._newest: VehicleState | None = None
        self._rates = Rates()

    def state(self) -> VehicleState | None:
        """The newest that it said."""
        state = self._context.bus.latest(self.vehicle)
        if isinstance(state, VehicleState) and state is not self._newest:
            if self._newest is None or state.time_us > self._newest.time_us:
                self._rates = _rates(self._newest, state)
            self._newest = state
        return self._newest

    def turned(self, at_us: int) -> tuple[float, float, float | None]:
        """Roll, pitch and yaw at a time that is near; yaw None: not known."""
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

    def place(self, at_us: int) -> Vector | None:
        """Where it is at a time that is near, in ECEF; None: not known."""
        state = self.state()
        if state is None or state.position is None:
            return None
        place = ecef(state.position)
        if state.velocity_enu_m_s is None:
            return place
        gone = np.array(state.velocity_enu_m_s) * self._ahead_s(state, at_us)
        moved: Vector = place + enu_of_ecef(state.position).T @ gone
        return moved

    def stance(self, at_us: int) -> Stance | None:
        """How it stands at a time that is near; None: where it is or heads is not known."""
        place = self.place(at_us)
        roll, pitch, yaw = self.turned(at_us)
        if place is None or yaw is None:
            return None
        return Stance(geodetic(place), yaw, roll, pitch)

    def home_m(self) -> float:
        """The altitude of its home: what relative altitudes count from."""
        state = self.state()
        if state is None or state.position is None or state.altitude_above_home_m is None:
            return self._context.origin[2]
        return state.position.altitude_m - state.altitude_above_home_m

    def ground_m(self) -> float:
        """The altitude of the ground: where it drives or floats; of what flies or dives, home's."""
        state = self.state()
        if self._domain in ("ground", "surface") and state is not None and state.position:
            return state.position.altitude_m
        return self.home_m()

    def missing(self) -> str:
        """What is not known of it; "" if all is."""
        state = self.state()
        if state is None or state.position is None:
            return f"where {self.vehicle} is, is not known"
        if state.yaw_rad is None:
            return f"where {self.vehicle} heads, is not known"
        return ""

    @staticmethod
    def _ahead_s(state: VehicleState, at_us: int) -> float:
        return min(max((at_us - state.time_us) / 1e6, 0.0), AHEAD_S)


def _rates(before: VehicleState | None, after: VehicleState) -> Rates:
    if before is None:
        return Rates()
    apart_s = (after.time_us - before.time_us) / 1e6
    if not _SHORTEST_S <= apart_s <= _LONGEST_S:
        return Rates()
    yaw = 0.0
    if before.yaw_rad is not None and after.yaw_rad is not None:
        yaw = math.remainder(after.yaw_rad - before.yaw_rad, math.tau)
    return Rates(
        math.remainder(after.roll_rad - before.roll_rad, math.tau) / apart_s,
        math.remainder(after.pitch_rad - before.pitch_rad, math.tau) / apart_s,
        yaw / apart_s,
    )
