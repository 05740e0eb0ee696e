"""What a mission does on the way: actions run one after the other while the vehicle goes on.

The first one begins before the item of navigation that follows, the next ones when it has begun
(ArduPilot: AP_Mission::advance_current_nav_cmd and advance_current_do_cmd).
"""

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

from m2pem_plugin_mavlink.sim.command import Command
from m2pem_plugin_mavlink.sim.missions.items import ACTIONS
from m2pem_plugin_mavlink.sim.missions.plan import Item
from m2pem_plugin_mavlink.sim.peers import Heard

if TYPE_CHECKING:
    from m2pem_plugin_mavlink.sim.autopilot import Autopilot

CONDITION_DELAY = 112
ITSELF = Heard(None, 0, 0)
"""The sender of commands that come from the mission."""
UNREPORTED = frozenset({181, 183, 203, 206, 211, 1000})
"""Those whose end ArduPilot does not report (AP_Mission::verify_command)."""


class Actions:
    """Does the actions that were begun; a delay holds up those behind it."""

    def __init__(self, autopilot: "Autopilot") -> None:
        self.autopilot = autopilot
        self._waiting: list[int] = []
        self._current: int | None = None
        self._delay_s = 0.0

    def begin(self, indices: Iterable[int]) -> None:
        """Do these; what is left of the ones before is dropped."""
        self._waiting, self._current = list(indices), None
        self._next()

    def finish(self) -> None:
        """Do all the others now."""
        while self._current is not None:
            self._done(self._current)

    def step(self, dt_s: float) -> None:
        """Report what is done by now, and begin the next one."""
        self._delay_s -= dt_s
        if self._current is not None and self._delay_s <= 0:
            self._done(self._current)

    def _done(self, index: int) -> None:
        pilot = self.autopilot
        command = pilot.mission.items[index].command
        if not (pilot.firmware.is_ardupilot and command in UNREPORTED):
            pilot.mission.reached(index)
        self._next()

    def _next(self) -> None:
        self._current = self._waiting.pop(0) if self._waiting else None
        if self._current is None:
            return
        pilot = self.autopilot
        item = pilot.mission.items[self._current]
        if pilot.firmware.is_ardupilot:
            pilot.say(f"Mission: {self._current} {ACTIONS[item.command]}")
        self._delay_s = item.param1 if item.command == CONDITION_DELAY else 0.0
        if item.command != CONDITION_DELAY:
            self._perform(item)

    def _perform(self, item: Item) -> None:
        """As if it had been commanded; what the vehicle cannot do, it leaves out."""
        command = Command(
            item.command,
            item.param1,
            item.param2,
            item.param3,
            0.0 if math.isnan(item.param4) else item.param4,
            item.latitude_deg,
            item.longitude_deg,
            item.z,
            item.frame,
            False,
            0,
            ITSELF,
        )
        self.autopilot.obey(command)
