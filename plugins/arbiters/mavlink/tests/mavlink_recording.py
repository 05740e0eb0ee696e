"""What an autopilot says in a conversation, written down step by step.

A step is a mapping: `do` (what the ground station did), and one list for each channel (below) in
which something was said. A value that an autopilot repeats is written down when it changes. Times
are seconds of the autopilot's own clock.
"""

import re
from typing import Any

from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as dialect

Step = dict[str, Any]
Trace = list[Step]

OWN = 255
"""System id of the ground station that records."""

ARDUPILOT_MODES = {
    "copter": mavutil.mode_mapping_acm,
    "rover": mavutil.mode_mapping_rover,
    "boat": mavutil.mode_mapping_rover,
    "plane": mavutil.mode_mapping_apm,
}

PX4_DESCEND = 4 << 16 | 20 << 24
"""AUTO.DESCEND, which pymavlink does not name."""

_BANNER = re.compile(
    r"^(ArduCopter|ArduRover|ArduPlane|Ardu|ChibiOS|SITL|Frame|RCOut|GPS \d|EKF3 (IMU|lane)|AHRS"
    r"|Barometer|Calibrating|IMU\d|RC Protocol|Airspeed|Logging|Init |Ground start|EKF variance"
    r"|Warning: Arming Checks|\[|[0-9a-f]{8} )"
)
"""Texts of a firmware about itself, its sensors and its estimator's lanes."""


def plain(text: str) -> str:
    """A text without the figures that change from run to run."""
    text = text.split("\t", maxsplit=1)[0]
    text = re.sub(r"-?\d+\.\d+", "N", text)
    return re.sub(r"\d+ ?(mAh|m|s|ms|cm|deg|%)\b", r"N \1", text).strip()


def name(enum: str, value: int) -> str:
    """A value's name without the prefix that the names of its enumeration share."""
    entry = dialect.enums[enum].get(value)
    if entry is None:
        return str(value)
    found: str = entry.name
    for prefix in (f"{enum}_", "MAV_MISSION_", "MAV_RESULT_", "MAV_STATE_", "MISSION_STATE_"):
        if found.startswith(prefix):
            return found[len(prefix) :]
    return found.removeprefix("MAV_CMD_")


class Recording:
    """`trace`: the steps so far; `latest`: the last message of each type; `known`: the last value
    of each channel whose values repeat."""

    def __init__(self, kind: str, firmware: str) -> None:
        self._modes = None if firmware == "px4" else ARDUPILOT_MODES[kind]
        self.trace: Trace = []
        self.latest: dict[str, Any] = {}
        self.known: dict[str, Any] = {}
        self._step: Step = {}
        self._chunks: dict[int, str] = {}

    def begin(self, what: str) -> None:
        """What follows belongs to a new step."""
        self._step = {"do": what}
        self.trace.append(self._step)

    def forget(self) -> None:
        """What was so far is not part of the trace."""
        self.trace.clear()
        self._step = {}

    def note(self, what: str, value: Any) -> None:
        """Write down a fact of this step."""
        self._step.setdefault("facts", {})[what] = value

    def took(self, what: str, seconds: float) -> None:
        """Write down how long it took until something was so."""
        self._step.setdefault("took", {})[what] = round(seconds, 1)

    def once(self, channel: str, value: Any) -> None:
        """Write down a value, unless this step has it already."""
        values = self._step.setdefault(channel, [])
        if value not in values:
            values.append(value)

    def _change(self, channel: str, value: Any) -> None:
        if channel in self.known and self.known[channel] == value:
            return
        self.known[channel] = value
        self._step.setdefault(channel, []).append(value)

    def take(self, m: Any) -> None:
        """A message has come from the autopilot."""
        kind = m.get_type()
        self.latest[kind] = m
        match kind:
            case "HEARTBEAT":
                self._change("mode", self._mode(m))
                self._change("armed", bool(m.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED))
                self._change("state", name("MAV_STATE", m.system_status))
            case "COMMAND_ACK":
                result = f"{name('MAV_CMD', m.command)} {name('MAV_RESULT', m.result)}"
                self.once("ack", result)
            case "MISSION_ACK":
                plan = name("MAV_MISSION_TYPE", m.mission_type)
                to = "" if m.target_system == OWN else " to the second station"
                self.once("plan", f"{plan} {name('MAV_MISSION_RESULT', m.type)}{to}")
            case "MISSION_REQUEST" | "MISSION_REQUEST_INT":
                self.once("plan", kind)
            case "MISSION_CURRENT":
                self._change("current", m.seq)
                self._change("mission", name("MISSION_STATE", m.mission_state))
                self._change("mission mode", m.mission_mode)
            case "MISSION_ITEM_REACHED":
                # PX4 repeats the last one ten times, once in a second.
                if self._modes is not None or self.known.get("reached") != m.seq:
                    self._step.setdefault("reached", []).append(m.seq)
                self.known["reached"] = m.seq
            case "EXTENDED_SYS_STATE":
                self._change("landed", name("MAV_LANDED_STATE", m.landed_state))
                self._change("vtol", name("MAV_VTOL_STATE", m.vtol_state))
            case "EKF_STATUS_REPORT" | "ESTIMATOR_STATUS":
                there = bool(m.flags & dialect.EKF_POS_HORIZ_ABS)
                constant = bool(m.flags & dialect.EKF_CONST_POS_MODE)
                self._change("position", f"{'there' if there else 'none'}{' const' * constant}")
            case "GPS_RAW_INT":
                self._change("fix", m.fix_type >= dialect.GPS_FIX_TYPE_3D_FIX)
            case "FENCE_STATUS":
                self._change("breach", bool(m.breach_status))
            case "STATUSTEXT":
                self._text(m)

    def _mode(self, heartbeat: Any) -> str:
        if self._modes is None and heartbeat.custom_mode == PX4_DESCEND:
            return "DESCEND"
        if self._modes is None:
            return str(mavutil.interpret_px4_mode(heartbeat.base_mode, heartbeat.custom_mode))
        return str(self._modes.get(heartbeat.custom_mode, heartbeat.custom_mode))

    def _text(self, m: Any) -> None:
        text = m.text
        if m.id:
            text = self._chunks.get(m.id, "") + text
            self._chunks[m.id] = text
            if len(m.text) == 50:
                return
            del self._chunks[m.id]
        if not _BANNER.match(text):
            warns = m.severity <= dialect.MAV_SEVERITY_WARNING
            self.once("warnings" if warns else "texts", plain(text))
