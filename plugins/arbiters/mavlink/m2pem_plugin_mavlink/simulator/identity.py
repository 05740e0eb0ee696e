"""The identity of the autopilot (HEARTBEAT, AUTOPILOT_VERSION) and its time."""

from collections.abc import Mapping
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.simulator.interfaces import (
    CommandHandler,
    Component,
    MessageHandler,
    ReportMaker,
)
from m2pem_plugin_mavlink.simulator.messages import Command, Result, Sender

EPOCH_S = 1_700_000_000
"""What its satellites say the time was when the simulation began, in Unix seconds."""


class Identity(Component):
    """Reports the identity."""

    def reports(self) -> Mapping[int, ReportMaker]:
        """What tells who it is."""
        return {
            dialect.MAVLINK_MSG_ID_HEARTBEAT: self._heartbeat,
            dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION: self._version,
            dialect.MAVLINK_MSG_ID_SYSTEM_TIME: self._system_time,
            dialect.MAVLINK_MSG_ID_TIMESYNC: self._ask_time,
        }

    def commands(self) -> Mapping[int, CommandHandler]:
        """Old ways to ask for its version."""
        return {
            dialect.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: self._tell_version,
            dialect.MAV_CMD_REQUEST_PROTOCOL_VERSION: self._tell_protocol,
        }

    def messages(self) -> Mapping[str, MessageHandler]:
        """Questions about time."""
        return {"TIMESYNC": self._timesync, "PING": self._ping}

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

    def _version(self) -> Any:
        firmware, system = self.autopilot.firmware, self.autopilot.spec.system
        return dialect.MAVLink_autopilot_version_message(
            firmware.capabilities,
            firmware.version,
            0,
            0,
            0,
            list(b"m2pemsim"),
            [0] * 8,
            [0] * 8,
            0,
            0,
            0x6D32_0000 + system,
            [*list(b"m2pem"), *[0] * 12, system],
        )

    def _system_time(self) -> Any:
        autopilot = self.autopilot
        unix_us = int((EPOCH_S + autopilot.now_s) * 1e6)
        return dialect.MAVLink_system_time_message(unix_us, autopilot.boot_ms)

    @property
    def _boot_ns(self) -> int:
        return int(self.autopilot.since_boot_s * 1e9)

    def _ask_time(self) -> Any:
        return dialect.MAVLink_timesync_message(0, self._boot_ns)

    def _timesync(self, message: Any, sender: Sender) -> None:
        if message.tc1 == 0:
            answer = dialect.MAVLink_timesync_message(self._boot_ns, message.ts1)
            self.autopilot.send(answer, sender.peer)

    def _ping(self, message: Any, sender: Sender) -> None:
        if message.target_system == 0 and message.target_component == 0:
            answer = dialect.MAVLink_ping_message(
                message.time_usec, message.seq, sender.system, sender.component
            )
            self.autopilot.send(answer, sender.peer)

    def _tell_version(self, command: Command) -> Result:
        self.autopilot.send(self._version(), command.sender.peer)
        return Result.ACCEPTED

    def _tell_protocol(self, command: Command) -> Result:
        nothing = [0] * 8
        answer = dialect.MAVLink_protocol_version_message(200, 100, 200, nothing, nothing)
        self.autopilot.send(answer, command.sender.peer)
        return Result.ACCEPTED
