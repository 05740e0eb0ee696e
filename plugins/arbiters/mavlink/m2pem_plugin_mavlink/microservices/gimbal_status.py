"""The direction and the controller that gimbals report (mavlink.io, "Gimbal Protocol v2",
services/gimbal_v2.html)."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type

WANTED = frozenset(
    message_type(name).id for name in ("GIMBAL_DEVICE_ATTITUDE_STATUS", "GIMBAL_MANAGER_STATUS")
)
MOST_GIMBALS = 16
"""Most gimbals of one vehicle."""

_ATTITUDE = message_type("GIMBAL_DEVICE_ATTITUDE_STATUS").id
_STATUS = message_type("GIMBAL_MANAGER_STATUS").id


@dataclass(frozen=True, slots=True)
class GimbalAttitude:
    """The attitude of a gimbal. Pitch: upwards from the horizon. Yaw: to the right, from the
    vehicle's heading and from true north; None if it is not known. `failures`:
    GIMBAL_DEVICE_ERROR_FLAGS."""

    roll_rad: float
    pitch_rad: float
    yaw_from_vehicle_rad: float | None
    yaw_from_north_rad: float | None
    failures: int
    at_s: float


class GimbalStatus:
    """The last state of each gimbal of a vehicle. Pass each message of `WANTED` to it.

    The sender and the id of the device identify a gimbal (0: one with an address of its own).
    """

    def __init__(self) -> None:
        self.attitudes: dict[tuple[Address, int], GimbalAttitude] = {}
        self.controllers: dict[tuple[Address, int], Address] = {}

    def take(self, message: Message, sender: Address, now_s: float) -> None:
        """Process a message of `WANTED`."""
        gimbal = sender, message.gimbal_device_id
        if message.TYPE.id == _ATTITUDE:
            attitude = attitude_of(message, now_s)
            if attitude is not None and _has_room(self.attitudes, gimbal):
                self.attitudes[gimbal] = attitude
        elif message.TYPE.id == _STATUS and _has_room(self.controllers, gimbal):
            system, component = message.primary_control_sysid, message.primary_control_compid
            self.controllers[gimbal] = Address(system, component)

    def attitude(self, device: int = 0) -> GimbalAttitude | None:
        """Return the state of a device; 0: of the gimbal that has sent last."""
        found = [each for (_, id_), each in self.attitudes.items() if device in (0, id_)]
        return max(found, key=lambda each: each.at_s, default=None)

    def controller(self, manager: Address, device: int = 0) -> Address | None:
        """Return the address in control; system 0: none, None: the manager has not reported it."""
        return next(
            (
                each
                for (sender, id_), each in self.controllers.items()
                if sender == manager and device in (0, id_)
            ),
            None,
        )


def attitude_of(message: Message, now_s: float) -> GimbalAttitude | None:
    """Return the attitude in a GIMBAL_DEVICE_ATTITUDE_STATUS; None if its quaternion is invalid."""
    angles = _roll_pitch_yaw(message.q)
    if angles is None:
        return None
    roll_rad, pitch_rad, yaw_rad = angles
    in_vehicle = message.flags & dialect.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME
    in_earth = message.flags & dialect.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME
    says_frame = bool(in_vehicle or in_earth)
    locked = message.flags & dialect.GIMBAL_DEVICE_FLAGS_YAW_LOCK
    from_north = bool(in_earth if says_frame else locked)
    other: float | None = None
    if says_frame and math.isfinite(message.delta_yaw):
        delta = -message.delta_yaw if from_north else message.delta_yaw
        other = math.remainder(yaw_rad + delta, math.tau)
    from_vehicle_rad, from_north_rad = (other, yaw_rad) if from_north else (yaw_rad, other)
    return GimbalAttitude(
        roll_rad, pitch_rad, from_vehicle_rad, from_north_rad, message.failure_flags, now_s
    )


def _has_room(known: Mapping[tuple[Address, int], object], gimbal: tuple[Address, int]) -> bool:
    return gimbal in known or len(known) < MOST_GIMBALS


def _roll_pitch_yaw(q: Sequence[float]) -> tuple[float, float, float] | None:
    size = math.hypot(*q)
    if not (math.isfinite(size) and size > 0.5):
        return None
    w, x, y, z = (each / size for each in q)
    return (
        math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
        math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x)))),
        math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
    )
