"""The progress of the mission: the current item, the state, and their messages."""

from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.simulator.interfaces import (
    AutopilotInterface,
    Component,
    makes,
    on_command,
    on_message,
)
from m2pem_plugin_mavlink.simulator.maneuvers import Land
from m2pem_plugin_mavlink.simulator.messages import Command, Result, Sender
from m2pem_plugin_mavlink.simulator.missions.execution import AutoMission
from m2pem_plugin_mavlink.simulator.missions.plan import MISSION, NAVIGATION, Item
from m2pem_plugin_mavlink.simulator.px4_maneuvers import TakeOff
from m2pem_plugin_mavlink.simulator.specification import Kind

MOST_JUMPS = 64
"""So many items without navigation in a row are a mission that goes around in circles."""

A_MOMENT_S = 0.1
MISSION_MODE_ACTIVE, MISSION_MODE_SUSPENDED = 1, 2
NO_MISSION, NOT_STARTED, ACTIVE, PAUSED, COMPLETE = range(1, 6)
"""MISSION_STATE."""


class MissionProgress(Component):
    """`current`: the item of navigation that it is at, or where it would begin.

    Of ArduPilot's, 0 is none. `resume_at`: where it goes on, an item of navigation or an action
    before it; `begun`: the mission was started since it was last at its beginning; `complete`: it
    was flown to its end; `released`: a ground station said MISSION_START, or it is in the air, so
    that it need not wait on the ground; `running`: the mode that flies it is on, and it is not
    complete; `paused`: a ground station has paused it, and the mode goes on (ArduCopter).
    """

    def __init__(self, autopilot: AutopilotInterface) -> None:
        super().__init__(autopilot)
        self.current = self.resume_at = 0
        self.begun = self.complete = self.released = self.running = False
        self.paused = False
        self._jumps: dict[int, int] = {}
        self._reached: list[tuple[float, int]] = []  # when, and which item

    @property
    def items(self) -> tuple[Item, ...]:
        """The mission as it is now."""
        return self.autopilot.plans[MISSION]

    @property
    def first(self) -> int:
        """Where a mission begins: behind the home position, if it has that."""
        return 1 if self.autopilot.firmware.is_ardupilot else 0

    @property
    def empty(self) -> bool:
        """There is nothing to fly."""
        return len(self.items) <= self.first

    @property
    def state(self) -> int:
        """MISSION_STATE; of ArduPilot only copters have a pause, PX4 goes by its mode."""
        ardupilot = self.autopilot.firmware.is_ardupilot
        if self.empty:
            return NO_MISSION
        if self.paused:
            return PAUSED
        if self.complete:
            return COMPLETE
        if self.running if ardupilot else self._mode == MISSION_MODE_ACTIVE:
            return ACTIVE
        paused = self.begun and not ardupilot
        return PAUSED if paused else NOT_STARTED

    @property
    def _mode(self) -> int:
        """As MISSION_CURRENT has it: ArduPilot says 0, unknown, where PX4 says 2, suspended. PX4
        counts the modes in which it takes off and lands as those of a mission."""
        maneuver = self.autopilot.modes.maneuver
        if self.autopilot.firmware.is_ardupilot:
            return MISSION_MODE_ACTIVE if isinstance(maneuver, AutoMission) else 0
        active = isinstance(maneuver, AutoMission | TakeOff | Land)
        return MISSION_MODE_ACTIVE if active else MISSION_MODE_SUSPENDED

    def restart(self) -> None:
        """Be at the beginning."""
        self.current = self.resume_at = self.first
        self.begun = self.complete = False
        self._jumps.clear()

    def replaced(self, marked: int | None) -> None:
        """Another mission was uploaded: PX4 is at the item that the ground station has marked as
        current, else at the number of the item that it was at, at once if it flies the mission."""
        at = self.resume_at if marked is None else marked
        self.restart()
        self.current = self.resume_at = max(0, min(at, len(self.items) - 1))
        maneuver = self.autopilot.modes.maneuver
        if self.running and isinstance(maneuver, AutoMission):
            maneuver.go_on(self.resume_at)

    def clear(self) -> None:
        """There is no mission any more."""
        self.current = self.resume_at = 0
        self.begun = self.complete = self.running = False

    def disarmed(self) -> None:
        """ArduPilot forgets where it was; in AUTO only copters do, which begin the mission anew
        that they had not completed."""
        self.released = False
        autopilot = self.autopilot
        if not autopilot.firmware.is_ardupilot:
            self.running = False
            return
        flies_it = isinstance(autopilot.modes.maneuver, AutoMission)
        if flies_it and autopilot.spec.kind is not Kind.COPTER:
            return
        self.current = self.resume_at = 0
        self._jumps.clear()
        if self.running and isinstance(autopilot.modes.maneuver, AutoMission):
            autopilot.modes.maneuver.go_on(self.first)

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
        """Go on from an item, now or when the mission is flown; ArduPilot's is then at the next
        item of navigation, and a completed mission has not been started; PX4 is at the item only
        when it flies the mission."""
        # Item 0, home, means the beginning.
        index = max(index, self.first)
        if index >= len(self.items):
            return False
        if index == self.first or self.complete:
            self._jumps.clear()
        maneuver = self.autopilot.modes.maneuver
        if self.running and isinstance(maneuver, AutoMission):
            maneuver.go_on(index)
            return not self.complete
        self.resume_at = index
        if self.autopilot.firmware.is_ardupilot:
            actions, following = self.advance(index)
            self.current = following or 0
            self.resume_at = actions[0] if actions else self.current
        self.complete = False
        return self.current >= self.first

    def reached(self, index: int) -> None:
        """Every ground station gets it; of items in a moment, the last one."""
        self._reached.append((self.autopilot.now_s, index))
        self.autopilot.log_event("reached", str(index))
        text = self.autopilot.firmware.reached_text(self.autopilot, index)
        if text:
            self.autopilot.say(text)

    def step(self, dt_s: float) -> None:
        """Send what was reached a moment ago."""
        if self._reached and self.autopilot.now_s - self._reached[0][0] >= A_MOMENT_S:
            self.autopilot.send(dialect.MAVLink_mission_item_reached_message(self._reached[-1][1]))
            self._reached.clear()

    @on_message("MISSION_SET_CURRENT")
    def _set(self, message: Any, sender: Sender) -> None:
        """ArduPilot answers with the number that was asked for, whatever it made of it."""
        if self.set_current(message.seq):
            self.autopilot.send(self._current(message.seq))

    @on_command(dialect.MAV_CMD_DO_SET_MISSION_CURRENT)
    def _command(self, command: Command) -> Result:
        index = int(command.param1)
        if index >= len(self.items):
            return Result.DENIED if self.autopilot.firmware.is_ardupilot else Result.FAILED
        if command.param2 == 1:
            self.restart()
        if index >= 0 and not self.set_current(index):
            return Result.FAILED
        self.autopilot.send(self._current())
        return Result.ACCEPTED

    @on_command(dialect.MAV_CMD_DO_PAUSE_CONTINUE)
    def _pause(self, command: Command) -> Result:
        """Stop on the way, or go on: copters of ArduPilot in AUTO (ModeAuto::pause)."""
        autopilot = self.autopilot
        if not (autopilot.firmware.is_ardupilot and autopilot.spec.kind is Kind.COPTER):
            return Result.UNSUPPORTED
        if not (self.running and isinstance(autopilot.modes.maneuver, AutoMission)):
            return Result.FAILED
        self.paused = command.param1 == 0
        return Result.ACCEPTED

    @makes(dialect.MAVLINK_MSG_ID_MISSION_CURRENT)
    def _current(self, seq: int | None = None) -> Any:
        return dialect.MAVLink_mission_current_message(
            self.current if seq is None else seq,
            max(0, len(self.items) - self.first),
            self.state,
            self._mode,
        )
