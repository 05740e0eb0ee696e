"""The gimbal, and the gimbal manager in the autopilot (mavlink.io, "Gimbal Protocol v2"). Angles in
radians; pitch up, yaw clockwise."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.simulator.geometry import Location, Point, towards, wrapped_rad
from m2pem_plugin_mavlink.simulator.interfaces import (
    AutopilotInterface,
    Component,
    makes,
    on_command,
    on_message,
)
from m2pem_plugin_mavlink.simulator.messages import Command, Result, Sender

PITCH_RAD = (math.radians(-90), math.radians(25))
YAW_RAD = (math.radians(-160), math.radians(160))
"""How far it turns, seen from the vehicle."""
FASTEST_RPS = math.radians(60)
NEUTRAL, RETRACTED = (0.0, 0.0), (math.radians(-90), 0.0)


@dataclass(slots=True)
class Pointing:
    """`yaw_rad` is seen from the vehicle; `wanted_yaw_rad` too, or (`locked`) from north.

    With rates it turns on until something else is asked for.
    """

    pitch_rad: float = 0.0
    yaw_rad: float = 0.0
    wanted_pitch_rad: float = 0.0
    wanted_yaw_rad: float = 0.0
    pitch_rps: float = 0.0
    yaw_rps: float = 0.0
    locked: bool = False
    turning: bool = False

    def point(self, pitch_rad: float, yaw_rad: float, locked: bool) -> None:
        """Turn to angles."""
        self.wanted_pitch_rad, self.wanted_yaw_rad = pitch_rad, wrapped_rad(yaw_rad)
        self.locked, self.turning = locked, False

    def turn(self, pitch_rps: float, yaw_rps: float, locked: bool, heading_rad: float) -> None:
        """Turn at rates until the next command."""
        self.wanted_pitch_rad = self.pitch_rad
        self.wanted_yaw_rad = wrapped_rad(self.yaw_rad + (heading_rad if locked else 0.0))
        self.pitch_rps, self.yaw_rps = pitch_rps, yaw_rps
        self.locked, self.turning = locked, True

    def step(self, dt_s: float, heading_rad: float) -> None:
        """Advance by `dt_s`, for a vehicle with that heading."""
        if self.turning:
            self.wanted_pitch_rad = _within(
                self.wanted_pitch_rad + self.pitch_rps * dt_s, PITCH_RAD
            )
            self.wanted_yaw_rad = wrapped_rad(self.wanted_yaw_rad + self.yaw_rps * dt_s)
        yaw_rad = self.wanted_yaw_rad - (heading_rad if self.locked else 0.0)
        most_rad = FASTEST_RPS * dt_s
        pitch_rad = _within(self.wanted_pitch_rad, PITCH_RAD)
        self.pitch_rad = towards(self.pitch_rad, pitch_rad, most_rad)
        self.yaw_rad = towards(self.yaw_rad, _within(wrapped_rad(yaw_rad), YAW_RAD), most_rad)

    def quaternion(self, heading_rad: float) -> list[float]:
        """Its attitude, level in roll; its yaw is from north if it is locked there."""
        yaw_rad = self.yaw_rad + (heading_rad if self.locked else 0.0)
        cp, sp = math.cos(self.pitch_rad / 2), math.sin(self.pitch_rad / 2)
        cy, sy = math.cos(yaw_rad / 2), math.sin(yaw_rad / 2)
        return [cp * cy, -sp * sy, sp * cy, cp * sy]


def _within(value: float, limits: tuple[float, float]) -> float:
    return max(limits[0], min(limits[1], value))


def pitch_and_yaw(q: list[float]) -> tuple[float, float]:
    """Of a quaternion (w, x, y, z)."""
    w, x, y, z = q
    pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
    return pitch, math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


DEVICE = 1
"""GIMBAL_DEVICE ids up to 6 are those that the autopilot speaks for."""
RETRACT, NEUTRAL_FLAG, YAW_LOCK = 1, 2, 16
YAW_FROM_VEHICLE, YAW_FROM_NORTH = 32, 64
ALWAYS = 4 | 8
"""GIMBAL_MANAGER_FLAGS; it is always stabilised in roll and pitch."""
CAPABILITIES = 1 | 2 | 4 | 16 | 32 | 128 | 256 | 512 | 1024 | 131072


class Controller(NamedTuple):
    """The system and component that control the gimbal."""

    system: int = 0
    component: int = 0


class Gimbal(Component):
    """`pointing`: where it points; `primary`, `secondary`: who controls it."""

    def __init__(self, autopilot: AutopilotInterface) -> None:
        super().__init__(autopilot)
        self.pointing = Pointing()
        self.primary, self.secondary = Controller(), Controller()
        self._target: Point | None = None

    # --- motion -----------------------------------------------------------------------------------

    def step(self, dt_s: float) -> None:
        """Move; follow the place of a region of interest."""
        body = self.autopilot.body
        if self._target is not None:
            here = body.point
            away_m = here.distance_m(self._target)
            pitch_rad = math.atan2(self._target.up_m - here.up_m, max(away_m, 1e-3))
            self.pointing.point(pitch_rad, here.bearing_rad(self._target), locked=True)
        self.pointing.step(dt_s, body.yaw_rad)

    def _point(
        self, flags: int, pitch_rad: float, yaw_rad: float, pitch_rps: float, yaw_rps: float
    ) -> bool:
        """As both the command and the message have it: angles, or (without them) rates."""
        self._target = None
        locked = bool(flags & (YAW_LOCK | YAW_FROM_NORTH)) and not flags & YAW_FROM_VEHICLE
        if flags & RETRACT:
            self.pointing.point(*RETRACTED, locked=False)
        elif flags & NEUTRAL_FLAG:
            self.pointing.point(*NEUTRAL, locked=False)
        elif math.isfinite(pitch_rad) and math.isfinite(yaw_rad):
            self.pointing.point(pitch_rad, yaw_rad, locked)
        elif math.isfinite(pitch_rps) and math.isfinite(yaw_rps):
            self.pointing.turn(pitch_rps, yaw_rps, locked, self.autopilot.body.yaw_rad)
        else:
            return False
        self.autopilot.log_event(
            "gimbal", f"{math.degrees(pitch_rad):.0f} {math.degrees(yaw_rad):.0f}"
        )
        return True

    # --- commands ---------------------------------------------------------------------------------

    @on_command(dialect.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE)
    def _configure(self, command: Command) -> Result:
        """Set who controls the gimbal: -1 keeps it, -2 is the sender, -3 releases the sender's
        control."""
        if int(command.z) not in (0, DEVICE):
            return Result.DENIED
        sender = Controller(command.sender.system, command.sender.component)
        self.primary = _controller(self.primary, command.param1, command.param2, sender)
        self.secondary = _controller(self.secondary, command.param3, command.param4, sender)
        self.autopilot.send(self._status())
        return Result.ACCEPTED

    def _may(self, sender: Sender) -> bool:
        """Return whether the sender may move it: PX4 requires control, ArduPilot does not."""
        who = Controller(sender.system, sender.component)
        free = not self.autopilot.firmware.gimbal_needs_control
        return free or who in (self.primary, self.secondary)

    @on_command(dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW)
    def _pitch_yaw(self, command: Command) -> Result:
        if not self._may(command.sender):
            return Result.DENIED
        if int(command.z) not in (0, DEVICE):
            return Result.FAILED
        angles = (command.param1, command.param2, command.param3, command.param4)
        self._point(command.flags, *map(math.radians, angles))
        return Result.ACCEPTED  # also of no angles, which change nothing

    @on_command(dialect.MAV_CMD_DO_SET_ROI_LOCATION, dialect.MAV_CMD_DO_SET_ROI)
    def _watch(self, command: Command) -> Result:
        if not command.has_position or not math.isfinite(command.z):
            return Result.DENIED
        autopilot = self.autopilot
        place = autopilot.frame.to_point(Location(command.latitude_deg, command.longitude_deg, 0.0))
        self._target = place.at_height(autopilot.guided.up_m(command.z, command.frame))
        return Result.ACCEPTED

    @on_command(dialect.MAV_CMD_DO_SET_ROI_NONE)
    def _watch_nothing(self, command: Command) -> Result:
        self._target = None
        self.pointing.point(*NEUTRAL, locked=False)
        return Result.ACCEPTED

    @on_message("GIMBAL_MANAGER_SET_PITCHYAW")
    def _set_pitch_yaw(self, message: Any, sender: Sender) -> None:
        if message.gimbal_device_id in (0, DEVICE) and self._may(sender):
            rates = (message.pitch_rate, message.yaw_rate)
            self._point(message.flags, message.pitch, message.yaw, *rates)

    @on_message("GIMBAL_MANAGER_SET_ATTITUDE")
    def _set_attitude(self, message: Any, sender: Sender) -> None:
        if message.gimbal_device_id not in (0, DEVICE) or not self._may(sender):
            return
        angles = (math.nan, math.nan)
        if all(map(math.isfinite, message.q)):
            angles = pitch_and_yaw(message.q)
        rates = (message.angular_velocity_y, message.angular_velocity_z)
        self._point(message.flags, *angles, *rates)

    # --- telemetry --------------------------------------------------------------------------------

    @property
    def _flags(self) -> int:
        return ALWAYS | (YAW_LOCK if self.pointing.locked else 0)

    @makes(dialect.MAVLINK_MSG_ID_GIMBAL_MANAGER_INFORMATION)
    def _information(self) -> Any:
        return dialect.MAVLink_gimbal_manager_information_message(
            self.autopilot.boot_ms, CAPABILITIES, DEVICE, 0.0, 0.0, *PITCH_RAD, *YAW_RAD
        )

    @makes(dialect.MAVLINK_MSG_ID_GIMBAL_MANAGER_STATUS)
    def _status(self) -> Any:
        return dialect.MAVLink_gimbal_manager_status_message(
            self.autopilot.boot_ms, self._flags, DEVICE, *self.primary, *self.secondary
        )

    @makes(dialect.MAVLINK_MSG_ID_GIMBAL_DEVICE_ATTITUDE_STATUS)
    def _attitude(self) -> Any:
        heading_rad = self.autopilot.body.yaw_rad
        frame = YAW_FROM_NORTH if self.pointing.locked else YAW_FROM_VEHICLE
        return dialect.MAVLink_gimbal_device_attitude_status_message(
            0,
            0,
            self.autopilot.boot_ms,
            self._flags | frame,
            self.pointing.quaternion(heading_rad),
            *[0.0] * 3,
            0,
            heading_rad,
            0.0,
            DEVICE,
        )


def _controller(now: Controller, system: float, component: float, sender: Controller) -> Controller:
    match int(system):
        case -1:
            return now
        case -2:
            return sender
        case -3:
            return Controller() if now == sender else now
    return Controller(int(system), max(0, int(component)))
