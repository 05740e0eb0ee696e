"""How far the mission is: the current item, its state, and what is told of that."""

from collections.abc import Mapping
from enum import IntEnum
from typing import TYPE_CHECKING, Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.sim.command import Command, Result
from m2pem_plugin_mavlink.sim.missions.items import NAVIGATION
from m2pem_plugin_mavlink.sim.missions.plan import MISSION, Item
from m2pem_plugin_mavlink.sim.part import CommandHandler, MessageHandler, Part, ReportMaker
from m2pem_plugin_mavlink.sim.peers import Heard

if TYPE_CHECKING:
    from m2pem_plugin_mavlink.sim.autopilot import Autopilot

MOST_JUMPS = 64
"""So many items without navigation in a row are a mission that goes around in circles."""


class MissionState(IntEnum):
    """MISSION_STATE."""

    NO_MISSION = 1
    NOT_STARTED = 2
    ACTIVE = 3
    PAUSED = 4
    COMPLETE = 5


class MissionProgress(Part):
    """`current`: the item of navigation that it is at, or where it would begin.

    `begun`: the mission was started since it was last at its beginning; `complete`: it was flown to
    its end; `released`: a ground station said MISSION_START, so that it may leave the ground;
    `running`: a maneuver flies it now; `redirected`: `current` was set, and it is to go on there.
    """

    def __init__(self, autopilot: "Autopilot") -> None:
        super().__init__(autopilot)
        self.current = 0
        self.begun = self.complete = self.released = self.running = False
        self.redirected = False
        self._jumps: dict[int, int] = {}

    @property
    def items(self) -> tuple[Item, ...]:
        """The mission as it is now."""
        return self.autopilot.plans[MISSION]

    @property
    def first(self) -> int:
        """Where a mission begins: behind the home position, if it has that."""
        return 1 if self.autopilot.firmware.mission_has_home else 0

    @property
    def empty(self) -> bool:
        """There is nothing to fly."""
        return len(self.items) <= self.first

    @property
    def state(self) -> MissionState:
        """As MISSION_CURRENT has it."""
        if self.empty:
            return MissionState.NO_MISSION
        if self.complete:
            return MissionState.COMPLETE
        if self.running and self.begun:
            return MissionState.ACTIVE
        return MissionState.PAUSED if self.begun else MissionState.NOT_STARTED

    def restart(self) -> None:
        """Be at the beginning."""
        self.current = self.first
        self.begun = self.complete = False
        self._jumps.clear()

    def advance(self, index: int) -> tuple[list[int], int | None]:
        """What comes from an item on: indices of actions on the way, and of the next navigation.

        Jumps are followed, and counted.
        """
        actions: list[int] = []
        jumped = 0
        while index < len(self.items):
            item = self.items[index]
            if item.command in NAVIGATION:
                return actions, index
            if item.command != dialect.MAV_CMD_DO_JUMP:
                actions.append(index)
                index += 1
                continue
            done = self._jumps.get(index, 0)
            jumped += 1
            if jumped > MOST_JUMPS:
                return actions, None
            if item.param2 < 0 or done < item.param2:
                self._jumps[index] = done + 1
                index = max(self.first, int(item.param1))
            else:
                index += 1
        return actions, None

    def set_current(self, index: int) -> bool:
        """Go on from an item."""
        if not self.first <= index < len(self.items):
            # Item 0, home, means the beginning.
            if index != 0 or self.empty:
                return False
            index = self.first
        self.current, self.complete = index, False
        self.autopilot.send(self._current())
        self.redirected = self.running
        return True

    def reached(self, index: int) -> None:
        """All are told."""
        self.autopilot.send(dialect.MAVLink_mission_item_reached_message(index))
        self.autopilot.note("reached", str(index))

    def step(self, dt_s: float) -> None:
        """The permission to take off ends with the motors' stop."""
        landed = not self.autopilot.arming.armed and self.autopilot.body.on_ground
        if landed and self.running:
            self.released = self.running = False

    def messages(self) -> Mapping[str, MessageHandler]:
        """The old way to set it."""
        return {"MISSION_SET_CURRENT": self._set}

    def commands(self) -> Mapping[int, CommandHandler]:
        """The new way."""
        return {dialect.MAV_CMD_DO_SET_MISSION_CURRENT: self._command}

    def reports(self) -> Mapping[int, ReportMaker]:
        """MISSION_CURRENT."""
        return {dialect.MAVLINK_MSG_ID_MISSION_CURRENT: self._current}

    def _set(self, message: Any, sender: Heard) -> None:
        self.set_current(message.seq)

    def _command(self, command: Command) -> Result:
        if command.param2 == 1:
            self.restart()
        index = int(command.param1)
        return Result.ACCEPTED if index < 0 or self.set_current(index) else Result.DENIED

    def _current(self) -> Any:
        total = max(0, len(self.items) - self.first)
        mode = 1 if self.running else 2
        return dialect.MAVLink_mission_current_message(
            min(self.current, 0xFFFF), total, self.state, mode
        )
