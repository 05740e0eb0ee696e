"""The behavior `reverse`: drive backwards over a distance."""

import math

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import BehaviorState, LatLon, offset
from m2pem_plugin_mavlink.behaviors.arrival import distance_to_m, is_still, position_of
from m2pem_plugin_mavlink.behaviors.behavior import (
    MOVES_WITHIN_S,
    Behavior,
    BehaviorContext,
    BehaviorFailedError,
    CheckpointState,
)
from m2pem_plugin_mavlink.behaviors.parameters import VehicleParameters
from m2pem_plugin_mavlink.vehicle.driver import FlightMode, TargetPosition

SPEED_M_S = 1.0
BEYOND_M = 5.0
"""Autopilots stop before their target, so the target is this distance further."""

STOPPING_S = 0.25
LOOK_EVERY_S = 0.1


class Reverse(Behavior):
    """Drive backwards over a distance, then stop: by DO_SET_REVERSE and a target behind the
    vehicle."""

    name = "reverse"
    modes = frozenset({FlightMode.GUIDED, FlightMode.HOLD})
    max_still_s = MOVES_WITHIN_S

    def __init__(self, context: BehaviorContext) -> None:
        super().__init__(context)
        parameters = VehicleParameters(context)
        self._distance_m = parameters.distance_m
        self._speed_m_s = parameters.speed_m_s or SPEED_M_S
        self._from = position_of(self.vehicle)
        self._yaw_rad = self.vehicle.state.yaw_rad
        self._done = False

    def refusal(self) -> str:
        """Check that position and heading are known, and that the path is inside the fence."""
        if self._from is None or self._yaw_rad is None:
            return "its position and heading are not known yet"
        behind = self._behind(self._from, self._yaw_rad, self._distance_m)
        return self.breach(behind, "the place behind it")

    def adjust(self, speed_m_s: float) -> bool:
        self._speed_m_s = speed_m_s
        return True

    async def begin(self) -> None:
        """Reverse, towards a target `BEYOND_M` behind the distance."""
        if self._from is None or self._yaw_rad is None:
            raise BehaviorFailedError("its position and heading are not known")
        if self._distance_m == 0:
            self._done = True
            return
        driver = self.vehicle.driver
        await driver.set_mode(FlightMode.GUIDED)  # a change of mode makes it drive forwards again
        await driver.arm()
        await driver.command(dialect.MAV_CMD_DO_SET_REVERSE, 1.0)
        beyond = self._behind(self._from, self._yaw_rad, self._distance_m + BEYOND_M)
        await driver.go_to(TargetPosition(*beyond), self._speed_m_s)

    async def resume(self) -> None:
        """Continue to the same target."""
        if not self._done:
            await self.begin()

    async def run_in_background(self) -> None:
        """Stop the vehicle after the distance."""
        if self._done:
            return
        while not self._covered():
            await self.vehicle.sleep(LOOK_EVERY_S)
        await self.vehicle.driver.stop()
        self._done = True

    def finished(self) -> bool:
        """Return whether the vehicle was stopped after the distance, and does not move."""
        return self._done and is_still(self.vehicle)

    async def clean_up(self) -> None:
        """Let the vehicle drive forwards again."""
        await self.vehicle.driver.command(dialect.MAV_CMD_DO_SET_REVERSE, 0.0)

    def _covered(self) -> bool:
        if self._from is None:
            return False
        speed = self.vehicle.state.speed_m_s
        rolls_on = STOPPING_S * speed if math.isfinite(speed) else 0.0
        driven = distance_to_m(self.vehicle, self._from)
        return math.isfinite(driven) and driven + rolls_on >= self._distance_m

    @staticmethod
    def _behind(place: LatLon, yaw_rad: float, distance_m: float) -> LatLon:
        return offset(place, -distance_m * math.cos(yaw_rad), -distance_m * math.sin(yaw_rad))

    async def reattach(self) -> BehaviorState:
        """Judge by the distance from the start."""
        mode = self.vehicle.state.mode
        if self._from is None or mode not in self.modes:
            return BehaviorState.UNKNOWN
        if self._covered():
            self._done = mode is FlightMode.HOLD
            over = self._done and is_still(self.vehicle)
            return BehaviorState.SUCCEEDED if over else BehaviorState.RUNNING
        moves = mode is FlightMode.GUIDED and not is_still(self.vehicle)
        return BehaviorState.RUNNING if moves else BehaviorState.UNKNOWN

    def checkpoint(self) -> CheckpointState:
        """Return the position and the yaw at the start."""
        return {"from": list(self._from or ()), "yaw": self._yaw_rad}

    def restore(self, checkpoint: CheckpointState) -> None:
        began, yaw = checkpoint.get("from"), checkpoint.get("yaw")
        if isinstance(began, list) and len(began) == 2 and isinstance(yaw, int | float):
            self._from, self._yaw_rad = (began[0], began[1]), float(yaw)
