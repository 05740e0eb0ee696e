"""Plans in the autopilot's permanent memory: the mission, the fence, the rally points."""

from typing import NamedTuple

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


class PlanStore:
    """What was uploaded. Item 0 of an ArduPilot mission (home) is not in it."""

    def __init__(self) -> None:
        self._items: dict[int, tuple[Item, ...]] = {MISSION: (), FENCE: (), RALLY: ()}

    def __getitem__(self, kind: int) -> tuple[Item, ...]:
        return self._items[kind]

    def __setitem__(self, kind: int, items: tuple[Item, ...]) -> None:
        self._items[kind] = items
