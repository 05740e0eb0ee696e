"""Commanding gimbals through their manager (mavlink.io, "Gimbal Protocol v2",
services/gimbal_v2.html), which is the autopilot unless a camera brings its own.

A client takes control of a gimbal before it points it, and releases control at the end.
A `device` of 0 is all gimbals of the manager. Pitch is positive upwards from the horizon, yaw
positive to the right.
"""

import math
from dataclasses import dataclass
from enum import Enum

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.microservices.commands import Command
from m2pem_plugin_mavlink.microservices.message_requests import RequestMessage
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type

ALL = 0
UNCHANGED = -1
LET_GO = -3
"""Value of the controller's ids that releases control."""

_SET_PITCHYAW = message_type("GIMBAL_MANAGER_SET_PITCHYAW")
_LEVEL: int = dialect.GIMBAL_MANAGER_FLAGS_ROLL_LOCK | dialect.GIMBAL_MANAGER_FLAGS_PITCH_LOCK


class YawFrame(Enum):
    """The direction from which yaw is measured."""

    VEHICLE = "vehicle"  # its forward direction; the gimbal turns with the vehicle
    NORTH = "north"  # true north; the gimbal stays when the vehicle turns


@dataclass(frozen=True, slots=True)
class Aim:
    """A direction to point to, with the camera level. None: the present angle.

    Raises:
        ValueError: an angle is not finite.
    """

    pitch_rad: float | None = None
    yaw_rad: float | None = None
    yaw_frame: YawFrame = YawFrame.VEHICLE

    def __post_init__(self) -> None:
        for angle_rad in (self.pitch_rad, self.yaw_rad):
            if angle_rad is not None and not math.isfinite(angle_rad):
                raise ValueError(f"{angle_rad} is not an angle of a gimbal")

    @property
    def flags(self) -> int:
        """GIMBAL_MANAGER_FLAGS."""
        north = self.yaw_frame is YawFrame.NORTH
        return _LEVEL | (dialect.GIMBAL_MANAGER_FLAGS_YAW_LOCK if north else 0)


@dataclass(frozen=True, slots=True)
class Gimbal:
    """The content of GIMBAL_MANAGER_INFORMATION. `device`: the id of the gimbal at the manager;
    ranges are (lowest, highest), `yaw_rad` from the vehicle's heading."""

    manager: Address
    device: int
    capabilities: int
    pitch_rad: tuple[float, float]
    yaw_rad: tuple[float, float]

    def has(self, capability: int) -> bool:
        """Return whether the gimbal has a capability (GIMBAL_MANAGER_CAP_FLAGS)."""
        return bool(self.capabilities & capability)

    @property
    def has_endless_yaw(self) -> bool:
        """Whether the gimbal can turn without end in one direction."""
        return self.has(dialect.GIMBAL_MANAGER_CAP_FLAGS_SUPPORTS_INFINITE_YAW)

    @property
    def locks_yaw(self) -> bool:
        """Whether the gimbal can point relative to north (`YawFrame.NORTH`)."""
        return self.has(dialect.GIMBAL_MANAGER_CAP_FLAGS_HAS_YAW_LOCK)


class FindGimbal(RequestMessage[Gimbal]):
    """Reads the gimbal of a manager.

    `device`: its id; 0: the first gimbal that the manager reports.
    """

    def __init__(self, target: Address, device: int = ALL) -> None:
        def read(message: Message) -> Gimbal | None:
            if device not in (ALL, message.gimbal_device_id):
                return None
            return Gimbal(
                target,
                message.gimbal_device_id,
                message.cap_flags,
                (message.pitch_min, message.pitch_max),
                (message.yaw_min, message.yaw_max),
            )

        super().__init__(target, "GIMBAL_MANAGER_INFORMATION", read)


def take_control(manager: Address, controller: Address, device: int = ALL) -> Command:
    """Give primary control to `controller`, which may be this ground station."""
    system, component = controller
    params = (system, component, UNCHANGED, UNCHANGED, 0, 0, device)
    return Command(manager, dialect.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE, params)


def release(manager: Address, device: int = ALL) -> Command:
    """Release control of the gimbal; refused without control."""
    params = (LET_GO, LET_GO, UNCHANGED, UNCHANGED, 0, 0, device)
    return Command(manager, dialect.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE, params)


def point(manager: Address, aim: Aim, device: int = ALL) -> Command:
    """Point the gimbal. The result is the acknowledgement; the attitude message has the
    direction."""
    pitch_deg, yaw_deg = (math.degrees(each) for each in _angles(aim))
    params = (pitch_deg, yaw_deg, math.nan, math.nan, aim.flags, 0, device)
    return Command(manager, dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, params)


def pointing(manager: Address, aim: Aim, device: int = ALL) -> Message:
    """Return `point` as a message without an answer, to send repeatedly
    (GIMBAL_MANAGER_SET_PITCHYAW)."""
    pitch_rad, yaw_rad = _angles(aim)
    return _SET_PITCHYAW.make(
        flags=aim.flags,
        pitch=pitch_rad,
        yaw=yaw_rad,
        pitch_rate=math.nan,
        yaw_rate=math.nan,
        **manager.as_target,
        gimbal_device_id=device,
    )


def stop(manager: Address, yaw_frame: YawFrame = YawFrame.VEHICLE, device: int = ALL) -> Command:
    """Stop turning: a rate of 0."""
    flags = Aim(yaw_frame=yaw_frame).flags
    params = (math.nan, math.nan, 0.0, 0.0, flags, 0, device)
    return Command(manager, dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, params)


def _angles(aim: Aim) -> tuple[float, float]:
    pitch_rad, yaw_rad = aim.pitch_rad, aim.yaw_rad
    return (
        math.nan if pitch_rad is None else pitch_rad,
        math.nan if yaw_rad is None else math.remainder(yaw_rad, math.tau),
    )
