"""Plans in the autopilot's permanent memory: the mission, the fence, the rally points."""

from typing import NamedTuple

from m2pem_plugin_mavlink.sim.command import GLOBAL_FRAMES

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
