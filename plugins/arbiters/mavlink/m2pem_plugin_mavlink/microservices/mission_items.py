"""The items of missions, fences and rally points, and the reasons why a vehicle refuses them
(mavlink.io, "Mission Protocol", services/mission.html; MAV_MISSION_RESULT, messages/common.html).
"""

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, TypeVar

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.protocol.messages import Address, Message, MessageType, message_type
from m2pem_plugin_mavlink.protocol.transaction import RefusedError, Transaction

T = TypeVar("T")

ACCEPTED: int = dialect.MAV_MISSION_ACCEPTED
CANCELLED: int = dialect.MAV_MISSION_OPERATION_CANCELLED
OUT_OF_SEQUENCE: int = dialect.MAV_MISSION_INVALID_SEQUENCE

_WORDS: dict[int, str] = {
    dialect.MAV_MISSION_ERROR: "not accepted, or not now",
    dialect.MAV_MISSION_UNSUPPORTED_FRAME: "its frame is not supported",
    dialect.MAV_MISSION_UNSUPPORTED: "not supported",
    dialect.MAV_MISSION_NO_SPACE: "there is no space for so many items",
    dialect.MAV_MISSION_INVALID: "a parameter has a value that is not valid",
    dialect.MAV_MISSION_INVALID_PARAM1: "param1 is not valid",
    dialect.MAV_MISSION_INVALID_PARAM2: "param2 is not valid",
    dialect.MAV_MISSION_INVALID_PARAM3: "param3 is not valid",
    dialect.MAV_MISSION_INVALID_PARAM4: "param4 is not valid",
    dialect.MAV_MISSION_INVALID_PARAM5_X: "param5 or latitude is not valid",
    dialect.MAV_MISSION_INVALID_PARAM6_Y: "param6 or longitude is not valid",
    dialect.MAV_MISSION_INVALID_PARAM7: "param7 or altitude is not valid",
    dialect.MAV_MISSION_INVALID_SEQUENCE: "out of sequence",
    dialect.MAV_MISSION_DENIED: "denied: another ground station may be uploading",
    dialect.MAV_MISSION_OPERATION_CANCELLED: "cancelled by the vehicle",
}
_OF_ONE_ITEM = frozenset(
    {
        dialect.MAV_MISSION_UNSUPPORTED_FRAME,
        dialect.MAV_MISSION_UNSUPPORTED,
        *range(dialect.MAV_MISSION_INVALID, dialect.MAV_MISSION_INVALID_PARAM7 + 1),
    }
)
_TEMPORARY = frozenset({dialect.MAV_MISSION_ERROR, dialect.MAV_MISSION_DENIED, CANCELLED})


def mission_result_words(result: int) -> str:
    """Return a text for a MAV_MISSION_RESULT other than "accepted"."""
    return _WORDS.get(result, f"refused with result {result}")


def is_of_one_item(result: int) -> bool:
    """Return whether a result concerns the item that was sent last."""
    return result in _OF_ONE_ITEM


def refusal(reason: str, result: int) -> RefusedError:
    """Return the error of an exchange that a vehicle refused with a MAV_MISSION_RESULT."""
    return RefusedError(reason, result, temporary=result in _TEMPORARY)


ITEM_INT = message_type("MISSION_ITEM_INT")
ITEM_FLOAT = message_type("MISSION_ITEM")
REQUEST_INT = message_type("MISSION_REQUEST_INT")

_NO_FRAME: int = dialect.MAV_FRAME_MISSION
_DEG_TO_1E7 = 1e7
_WITHOUT_INT: dict[int, int] = {
    dialect.MAV_FRAME_GLOBAL_INT: dialect.MAV_FRAME_GLOBAL,
    dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT: dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT,
    dialect.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT: dialect.MAV_FRAME_GLOBAL_TERRAIN_ALT,
}

_GLOBAL = frozenset({*_WITHOUT_INT, *_WITHOUT_INT.values()})


def same_frame(frame: int) -> int:
    """Return one MAV_FRAME for those that mean the same: autopilots return either."""
    return _WITHOUT_INT.get(frame, frame)


class MissionType(IntEnum):
    """The kinds of stored items: MAV_MISSION_TYPE."""

    MISSION = dialect.MAV_MISSION_TYPE_MISSION
    FENCE = dialect.MAV_MISSION_TYPE_FENCE
    RALLY = dialect.MAV_MISSION_TYPE_RALLY


@dataclass(frozen=True, slots=True)
class MissionItem:
    """One item. `frame`: a MAV_FRAME; `command`: a MAV_CMD; `params`: its param1..param4, NaN for
    "as it is"; `latitude_deg`, `longitude_deg` (WGS-84), `altitude_m`: its x, y, z if it has a
    place, else its param5..param7 (`frame` MAV_FRAME_MISSION). `autocontinue`: continue with the
    next item."""

    command: int
    frame: int
    params: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    latitude_deg: float = 0.0
    longitude_deg: float = 0.0
    altitude_m: float = 0.0
    autocontinue: bool = True

    @property
    def latlon(self) -> tuple[float, float]:
        """Latitude and longitude in degrees."""
        return self.latitude_deg, self.longitude_deg

    def same_as(self, other: "MissionItem") -> bool:
        """Return whether both are the same, except for changes by storing them: an autopilot keeps
        coordinates in 1e-7 degrees and altitudes as floats of 32 or fewer bits, and returns an
        equivalent frame."""
        return (
            self.command == other.command
            and same_frame(self.frame) == same_frame(other.frame)
            and abs(self.latitude_deg - other.latitude_deg) < 2.5e-7
            and abs(self.longitude_deg - other.longitude_deg) < 2.5e-7
            and math.isclose(self.altitude_m, other.altitude_m, rel_tol=1e-6, abs_tol=0.01)
        )

    def is_stored_as(self, other: "MissionItem") -> bool:
        """Return whether an item that was read is one that was uploaded. Autopilots return items
        without a place in different ways; of those, the second parameter (a speed) counts."""
        if other.latitude_deg == 0.0 and other.longitude_deg == 0.0:
            same = math.isclose(self.params[1], other.params[1], rel_tol=1e-3, abs_tol=0.01)
            return self.command == other.command and (same or math.isnan(other.params[1]))
        return self.same_as(other)

    def problem(self) -> str:
        """Return why the item cannot be uploaded; "" if it can."""
        if not 0 <= self.command <= 0xFFFF:
            return f"command {self.command} does not exist"
        if any(math.isinf(each) for each in self.params):
            return "a parameter is infinite"
        if not math.isfinite(self.altitude_m):
            return f"altitude {self.altitude_m} m"
        x, y = self.latitude_deg, self.longitude_deg
        if self.frame in _GLOBAL:
            sound = abs(x) <= 90.0 and abs(y) <= 180.0  # False for NaN
            return "" if sound else f"{x}, {y} is not a position"
        if self.frame != _NO_FRAME:
            return f"frame {self.frame} is not a global one"
        whole = math.isfinite(x) and math.isfinite(y) and max(abs(x), abs(y)) < 2**31
        return "" if whole else f"param5 {x}, param6 {y}"


def item_message(
    item: MissionItem, sequence: int, target: Address, mission_type: MissionType
) -> Message:
    """Return a MISSION_ITEM_INT. The first item of a mission is marked as current: PX4 begins
    there, and some ground stations require exactly one."""
    scale = 1.0 if item.frame == _NO_FRAME else _DEG_TO_1E7
    named = {f"param{number}": float(each) for number, each in enumerate(item.params, 1)}
    return ITEM_INT.make(
        **named,
        x=round(item.latitude_deg * scale),
        y=round(item.longitude_deg * scale),
        z=item.altitude_m,
        seq=sequence,
        command=item.command,
        **target.as_target,
        frame=item.frame,
        current=int(sequence == 0 and mission_type is MissionType.MISSION),
        autocontinue=int(item.autocontinue),
        mission_type=mission_type,
    )


def item_of(message: Message) -> MissionItem:
    """Return the item in a MISSION_ITEM_INT or MISSION_ITEM. It may be invalid: see
    `MissionItem.problem`."""
    is_scaled = message.TYPE is ITEM_INT and message.frame != _NO_FRAME
    scale = _DEG_TO_1E7 if is_scaled else 1.0
    return MissionItem(
        command=message.command,
        frame=message.frame,
        params=(message.param1, message.param2, message.param3, message.param4),
        latitude_deg=message.x / scale,
        longitude_deg=message.y / scale,
        altitude_m=message.z,
        autocontinue=bool(message.autocontinue),
    )


class MissionExchange(Transaction[T]):
    """An exchange about the items of one kind that a vehicle stores."""

    def __init__(self, target: Address, mission_type: MissionType) -> None:
        super().__init__(("mission", target))
        self.target, self.mission_type = target, mission_type
        self.what = mission_type.name.lower()

    def is_expected(self, message: Message, sender: Address) -> bool:
        """Return whether a message is about these items, and for this ground station."""
        of_target = sender == self.target and message.mission_type == self.mission_type
        return of_target and self.for_us(message)

    def send(self, type_: MessageType, **fields: Any) -> None:
        """Send a message about these items."""
        target = self.target.as_target
        self.outbox.append(type_.make(**target, mission_type=self.mission_type, **fields))
