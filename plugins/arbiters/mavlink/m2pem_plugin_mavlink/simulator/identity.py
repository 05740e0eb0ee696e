"""The identity of the autopilot (HEARTBEAT, AUTOPILOT_VERSION) and its time."""

from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.simulator.interfaces import (
    Component,
    makes,
)

EPOCH_S = 1_700_000_000
"""What its satellites say the time was when the simulation began, in Unix seconds."""


class Identity(Component):
    """Reports the identity."""

    @makes(dialect.MAVLINK_MSG_ID_HEARTBEAT)
    def _heartbeat(self) -> Any:
        autopilot = self.autopilot
        active = autopilot.firmware.active(autopilot)
        status = dialect.MAV_STATE_ACTIVE if active else dialect.MAV_STATE_STANDBY
        if any(component.failsafe for component in autopilot.components):
            status = dialect.MAV_STATE_CRITICAL
        return dialect.MAVLink_heartbeat_message(
            autopilot.firmware.vehicle_type,
            autopilot.firmware.autopilot_id,
            autopilot.firmware.base_mode(autopilot),
            autopilot.modes.mode.number,
            status,
            3,
        )

    @makes(dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
    def _version(self) -> Any:
        firmware, system = self.autopilot.firmware, self.autopilot.spec.system
        return dialect.MAVLink_autopilot_version_message(
            firmware.capabilities,
            firmware.version,
            *[0] * 3,
            list(b"m2pemsim"),
            [0] * 8,
            [0] * 8,
            0,
            0,
            0x6D32_0000 + system,
            [*list(b"m2pem"), *[0] * 12, system],
        )

    @makes(dialect.MAVLINK_MSG_ID_SYSTEM_TIME)
    def _system_time(self) -> Any:
        autopilot = self.autopilot
        unix_us = int((EPOCH_S + autopilot.now_s) * 1e6)
        return dialect.MAVLink_system_time_message(unix_us, autopilot.boot_ms)

    @property
    def _boot_ns(self) -> int:
        return int(self.autopilot.since_boot_s * 1e9)

    @makes(dialect.MAVLINK_MSG_ID_TIMESYNC)
    def _ask_time(self) -> Any:
        return dialect.MAVLink_timesync_message(0, self._boot_ns)
