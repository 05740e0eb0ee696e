"""The bench for a vehicle with PX4."""

import math
from typing import Any

from m2pem_plugin_mavlink.simulator.specification import Kind
from mavlink_bench import Bench
from pymavlink.dialects.v20 import ardupilotmega as dialect

ARM, MODE = dialect.MAV_CMD_COMPONENT_ARM_DISARM, dialect.MAV_CMD_DO_SET_MODE
TAKEOFF, REPOSITION = dialect.MAV_CMD_NAV_TAKEOFF, dialect.MAV_CMD_DO_REPOSITION
START = dialect.MAV_CMD_MISSION_START
ACCEPTED, LATER, DENIED, UNSUPPORTED = 0, 1, 2, 3
NAN = math.nan
GROUND_M = 488.0
"""Home, above the sea."""


class Px4Bench(Bench):
    """One vehicle with PX4; it is armed and taken off in PX4's way. `beats`: the ground station
    sends heartbeats, without which it gets no texts."""

    def __init__(self, kind: Kind = Kind.COPTER, **options: Any) -> None:
        super().__init__(kind, firmware="px4", **options)
        self.beats = True

    def run(self, seconds: float) -> None:
        """Let time pass."""
        while seconds > 0:
            if self.beats:
                self.tell(dialect.MAVLink_heartbeat_message(dialect.MAV_TYPE_GCS, 8, 0, 0, 4, 3))
            super().run(min(seconds, 1.0))
            seconds -= 1.0

    @property
    def mode(self) -> str:
        """Its name."""
        return self.autopilot.modes.mode.name

    def enter(self, main: int, sub: int = 0) -> int:
        """Command a mode; the result."""
        return self.command(MODE, 1, main, sub)

    def ready(self) -> "Px4Bench":
        """Armed in AUTO.LOITER."""
        self.run_until(lambda: self.autopilot.estimator.ready)
        assert self.command(ARM, 1) == ACCEPTED
        return self

    def airborne(self, height_m: float = 20.0) -> "Px4Bench":
        """A copter that hovers."""
        self.ready()
        assert self.command(TAKEOFF, *[NAN] * 6, GROUND_M + height_m) == ACCEPTED
        self.run_until(lambda: self.mode == "AUTO.LOITER")
        self.run(3)
        return self

    def velocity(self, north_mps: float, east_mps: float = 0.0, up_mps: float = 0.0) -> None:
        """One setpoint."""
        self.tell(
            dialect.MAVLink_set_position_target_local_ned_message(
                0, 1, 1, 1, 0xDC7, 0, 0, 0, north_mps, east_mps, -up_mps, 0, 0, 0, 0, 0
            )
        )
