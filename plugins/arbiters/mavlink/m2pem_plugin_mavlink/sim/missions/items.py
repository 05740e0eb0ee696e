"""Items of plans: reading them from messages, making messages, and which ones are sound."""

import math
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.sim.command import GLOBAL_FRAMES
from m2pem_plugin_mavlink.sim.missions.plan import FENCE, MISSION, Item

ACCEPTED = 0
UNSUPPORTED_FRAME, UNSUPPORTED = 2, 3
INVALID_PARAM1, INVALID_X, INVALID_Y, INVALID_ALTITUDE = 6, 10, 11, 12
"""MAV_MISSION_RESULT."""

NAVIGATION: dict[int, str] = {
    16: "WP",
    17: "LoitUnlim",
    18: "LoitTurns",
    19: "LoitTime",
    20: "RTL",
    21: "Land",
    22: "Takeoff",
    31: "LoitAltitude",
    82: "SplineWP",
    93: "Delay",
}
"""What the vehicle does one after the other: MAV_CMD to ArduPilot's name."""

ACTIONS: dict[int, str] = {
    112: "CondDelay",
    115: "CondYaw",
    177: "Jump",
    178: "ChangeSpeed",
    179: "SetHome",
    181: "SetRelay",
    183: "SetServo",
    189: "LandStart",
    194: "SetReverse",
    195: "SetROI",
    197: "SetROI",
    201: "SetROI",
    203: "DigiCamCtrl",
    205: "MountControl",
    206: "SetCamTrigDst",
    207: "FenceEnable",
    211: "Gripper",
    1000: "GimbalPitchYaw",
}
"""What it does on the way."""

WITH_PLACE = frozenset({16, 17, 18, 19, 21, 31, 82})
"""Those that are of no use with a place off the Earth."""
FENCE_COMMANDS = frozenset(range(5000, 5005))
RALLY_COMMANDS = frozenset({5100})
MISSION_FRAME = 2
FRAMES = GLOBAL_FRAMES | {1, MISSION_FRAME}


def item_of(message: Any) -> Item:
    """The item in MISSION_ITEM_INT, or in the old MISSION_ITEM (degrees as floats).

    Raises:
        ValueError: a coordinate is not a number.
        OverflowError: a coordinate is infinite.
    """
    x, y = message.x, message.y
    if message.get_msgId() == dialect.MAVLINK_MSG_ID_MISSION_ITEM:
        x, y = round(x * 1e7), round(y * 1e7)
        if max(abs(x), abs(y)) >= 1 << 31:
            raise OverflowError(f"{message.x}, {message.y} is no place")
    return Item(
        message.frame,
        message.command,
        message.param1,
        message.param2,
        message.param3,
        message.param4,
        x,
        y,
        message.z,
        message.autocontinue,
    )


def fault_of(kind: int, item: Item) -> int:
    """What is wrong with an item (MAV_MISSION_RESULT), or ACCEPTED."""
    if kind == MISSION:
        known = item.command in NAVIGATION or item.command in ACTIONS
    else:
        known = item.command in (FENCE_COMMANDS if kind == FENCE else RALLY_COMMANDS)
    if not known:
        return UNSUPPORTED
    if item.frame not in FRAMES:
        return UNSUPPORTED_FRAME
    # Heading (parameter 4) may be left out as NaN.
    for index, value in enumerate(item[2:5]):
        if not math.isfinite(value):
            return INVALID_PARAM1 + index
    if kind != MISSION or item.command in WITH_PLACE:
        if abs(item.x) > 900_000_000:
            return INVALID_X
        if abs(item.y) > 1_800_000_000:
            return INVALID_Y
    return ACCEPTED if math.isfinite(item.z) else INVALID_ALTITUDE


def message_of(
    item: Item, seq: int, kind: int, current: bool, to: tuple[int, int], whole: bool
) -> Any:
    """As MISSION_ITEM_INT, or (not `whole`) as the old MISSION_ITEM."""
    make = dialect.MAVLink_mission_item_int_message
    x: float = item.x
    y: float = item.y
    if not whole:
        make = dialect.MAVLink_mission_item_message
        x, y = x * 1e-7, y * 1e-7
    return make(
        *to,
        seq,
        item.frame,
        item.command,
        int(current),
        item.autocontinue,
        item.param1,
        item.param2,
        item.param3,
        item.param4,
        x,
        y,
        item.z,
        kind,
    )
