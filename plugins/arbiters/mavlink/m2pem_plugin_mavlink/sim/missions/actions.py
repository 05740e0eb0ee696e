"""What a mission does on the way: actions run one after the other while the vehicle goes on."""

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


class Actions:
    """Does the actions that were begun; a delay holds up those behind it."""

    def __init__(self, autopilot: "Autopilot") -> None:
        self.autopilot = autopilot
        self._waiting: list[Item] = []
        self._delay_s = 0.0

    def begin(self, indices: Iterable[int]) -> None:
        """Do these; what is left of the ones before is dropped."""
        items = self.autopilot.mission.items
        self._waiting = []
        self._delay_s = 0.0
        for index in indices:
            self._waiting.append(items[index])
            self.autopilot.say(f"Mission: {index} {ACTIONS[items[index].command]}")
        self.step(0.0)

    def step(self, dt_s: float) -> None:
        """Do what may be done by now."""
        self._delay_s -= dt_s
        while self._waiting and self._delay_s <= 0:
            item = self._waiting.pop(0)
            if item.command == CONDITION_DELAY:
                self._delay_s = item.param1
            else:
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
