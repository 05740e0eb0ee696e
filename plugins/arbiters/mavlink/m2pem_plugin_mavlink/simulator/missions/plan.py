"""Plans in the autopilot's permanent memory: the mission, the fence, the rally points."""

import math
from typing import Any, NamedTuple

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.simulator.messages import GLOBAL_FRAMES

MISSION, FENCE, RALLY = 0, 1, 2
"""MAV_MISSION_TYPE."""


class Item(NamedTuple):
    """One item, as it travels: `x` and `y` in 1e-7 degrees if the frame is global."""

    frame: int
    command: int
    param1: float
    param2: float
    param3: float
    param4: float
    x: int
    y: int
    z: float
    autocontinue: int = 1

    @property
    def latitude_deg(self) -> float:
        """Of its place."""
        return self.x * 1e-7

    @property
    def longitude_deg(self) -> float:
        """Of its place."""
        return self.y * 1e-7

    @property
    def has_place(self) -> bool:
        """It says where; without, it is where the vehicle then is."""
        return self.frame in GLOBAL_FRAMES and (self.x != 0 or self.y != 0)


class PlanStore:
    """What was uploaded, by MAV_MISSION_TYPE; a mission with ArduPilot's item 0 (home).

    An upload to ArduPilot changes the plan item by item: one that is abandoned leaves the new items
    that came and, behind them, nothing.
    """

    def __init__(self) -> None:
        self._items: dict[int, tuple[Item, ...]] = {MISSION: (), FENCE: (), RALLY: ()}
        self.changes = 0

    def __getitem__(self, kind: int) -> tuple[Item, ...]:
        return self._items[kind]

    def __setitem__(self, kind: int, items: tuple[Item, ...]) -> None:
        self._items[kind] = items
        self.changes += 1

    def put(self, kind: int, index: int, item: Item) -> None:
        """Replace an item, or append it."""
        items = self._items[kind]
        self[kind] = (*items[:index], item, *items[index + 1 :])


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
    181: "SetRelay",
    183: "SetServo",
    189: "LandStart",
    194: "SetReverse",
    195: "SetROI",
    197: "SetROI",
    201: "SetROI",
    203: "DigiCamCtrl",
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
    """The item in MISSION_ITEM_INT."""
    return Item(*(getattr(message, name) for name in Item._fields))


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


def message_of(item: Item, seq: int, kind: int, current: bool, to: tuple[int, int]) -> Any:
    """As MISSION_ITEM_INT."""
    return dialect.MAVLink_mission_item_int_message(
        *to,
        seq,
        item.frame,
        item.command,
        int(current),
        item.autocontinue,
        *item[2:9],  # its parameters and its place
        kind,
    )
