"""The battery: it drains while motors run, faster in motion."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.sim.part import Part, ReportMaker

if TYPE_CHECKING:
    from m2pem_plugin_mavlink.sim.autopilot import Autopilot

FULL_V, EMPTY_V = 12.6, 10.5
"""Three lithium cells."""
IDLE = 0.02
"""What electronics alone take, as a part of what moving takes."""


class Battery(Part):
    """`left`: 0 to 1; it may be set."""

    def __init__(self, autopilot: "Autopilot") -> None:
        super().__init__(autopilot)
        self.left = getattr(getattr(autopilot, "battery", None), "left", 1.0)
        self._load = IDLE

    @property
    def voltage_v(self) -> float:
        """Falls with the charge."""
        return EMPTY_V + (FULL_V - EMPTY_V) * self.left

    @property
    def current_a(self) -> float:
        """What is drawn now."""
        capacity_mah: float = self.autopilot.parameters["BATT_CAPACITY"]
        return capacity_mah * 3.6 / self.autopilot.spec.battery_s * self._load

    @property
    def percent(self) -> int:
        """As it is reported."""
        return max(0, min(100, int(self.left * 100 + 1e-6)))

    def step(self, dt_s: float) -> None:
        """Drain it."""
        armed, body = self.autopilot.arming.armed, self.autopilot.body
        self._load = IDLE if not armed else 1.0 if body.moving or not body.on_ground else 0.1
        self.left = max(0.0, self.left - dt_s * self._load / self.autopilot.spec.battery_s)

    def reports(self) -> Mapping[int, ReportMaker]:
        """BATTERY_STATUS."""
        return {dialect.MAVLINK_MSG_ID_BATTERY_STATUS: self._status}

    def _status(self) -> object:
        used_mah = (1 - self.left) * self.autopilot.parameters["BATT_CAPACITY"]
        return dialect.MAVLink_battery_status_message(
            0,
            dialect.MAV_BATTERY_FUNCTION_UNKNOWN,
            dialect.MAV_BATTERY_TYPE_UNKNOWN,
            0x7FFF,
            [round(self.voltage_v * 1000), *[0xFFFF] * 9],
            round(self.current_a * 100),
            round(used_mah),
            -1,
            self.percent,
        )
