"""Executing the mission: AUTO of ArduPilot and AUTO.MISSION of PX4."""

import math
from collections.abc import Iterable, Iterator

from pymavlink.dialects.v20.ardupilotmega import MAV_SEVERITY_NOTICE

from m2pem_plugin_mavlink.simulator.dynamics import MotionSetpoint
from m2pem_plugin_mavlink.simulator.interfaces import AutopilotInterface, Component, Maneuver
from m2pem_plugin_mavlink.simulator.maneuvers import HoldPosition
from m2pem_plugin_mavlink.simulator.messages import Command, Sender
from m2pem_plugin_mavlink.simulator.missions.legs import NAV_TAKEOFF, Leg, Return, leg_of
from m2pem_plugin_mavlink.simulator.missions.plan import ACTIONS, MISSION, NAVIGATION, Item
from m2pem_plugin_mavlink.simulator.specification import SURFACE, Kind

CONDITION_DELAY = 112
ITSELF = Sender(None, 0, 0)
"""The sender of commands that come from the mission."""
UNREPORTED = frozenset({181, 183, 203, 206, 211, 1000})
"""Those whose end ArduPilot does not report (AP_Mission::verify_command)."""


class Actions:
    """Does the actions that were begun; a delay holds up those behind it."""

    def __init__(self, autopilot: AutopilotInterface) -> None:
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
        autopilot = self.autopilot
        command = autopilot.mission.items[index].command
        if not (autopilot.firmware.is_ardupilot and command in UNREPORTED):
            autopilot.mission.reached(index)
        self._next()

    def _next(self) -> None:
        self._current = self._waiting.pop(0) if self._waiting else None
        if self._current is None:
            return
        autopilot = self.autopilot
        item = autopilot.mission.items[self._current]
        if autopilot.firmware.is_ardupilot:
            autopilot.say(f"Mission: {self._current} {ACTIONS[item.command]}")
        self._delay_s = item.param1 if item.command == CONDITION_DELAY else 0.0
        if item.command != CONDITION_DELAY:
            self._perform(item)

    def _perform(self, item: Item) -> None:
        """As if it had been commanded; what the vehicle cannot do, it leaves out."""
        param4 = 0.0 if math.isnan(item.param4) else item.param4
        params = (item.param1, item.param2, item.param3, param4)
        place = (item.latitude_deg, item.longitude_deg, item.z)
        command = Command(item.command, *params, *place, item.frame, False, 0, ITSELF)
        self.autopilot.obey(command)


LOOKS_AHEAD = 3
"""So many items are watched for changes (Mission_Change_Detector)."""


class AutoMission(Maneuver):
    """AUTO: flies the mission from where it was; complete, it begins anew when the mode is left and
    entered again, and not before (ArduPilot: AP_Mission::start_or_resume)."""

    _leg: Leg | None = None
    _index: int | None = None
    _ahead: tuple[Item, ...] = ()
    _paused_at: HoldPosition | None = None

    @property
    def takes_speed(self) -> bool:
        """Always, but boats that keep their station."""
        return self._leg is not None or self.autopilot.spec.kind is not Kind.BOAT

    def refusal(self) -> str | None:
        """An armed copter on the ground needs a mission that begins with a takeoff; what drives
        needs one even while it is not armed."""
        autopilot, progress = self.autopilot, self.autopilot.mission
        surface = autopilot.spec.kind in SURFACE
        if not (autopilot.arming.armed or surface):
            return None
        if progress.empty:
            if surface:
                autopilot.say("No Mission. Can't set AUTO.", MAV_SEVERITY_NOTICE)
            return "init failed"
        if autopilot.spec.kind is Kind.COPTER and autopilot.body.on_ground:
            ahead = progress.items[self._start() :]
            first = next((item.command for item in ahead if item.command in NAVIGATION), None)
            if first != NAV_TAKEOFF:
                autopilot.warn("Auto: Missing Takeoff Cmd")
                return "init failed"
        return None

    def _start(self) -> int:
        """The item to begin with."""
        autopilot, progress = self.autopilot, self.autopilot.mission
        # A new plan may be shorter than the one in which it was.
        known = progress.first <= progress.resume_at < len(progress.items)
        again = progress.complete or not known
        if again or autopilot.parameters.get("MIS_RESTART") == 1:
            return progress.first
        return progress.resume_at

    def begin(self) -> None:
        """Start or go on, armed or not; what goes on already does so when it is armed."""
        self._stay = HoldPosition(self.autopilot)
        if not self.autopilot.mission.running:
            self.start()

    def start(self) -> None:
        """Begin the mission, or go on where it was."""
        autopilot, progress = self.autopilot, self.autopilot.mission
        self._actions = Actions(autopilot)
        start = self._start()
        if progress.complete or start == progress.first:
            progress.restart()
            autopilot.log_event("mission", f"{len(progress.items)} items")
        progress.running = progress.begun = True
        progress.complete = False
        self.go_on(start)

    def end(self) -> None:
        """Another mode has been entered."""
        self.autopilot.mission.running = self.autopilot.mission.paused = False

    def step(self, dt_s: float) -> MotionSetpoint:
        """Fly the present leg, and go on to the next when it is done."""
        autopilot, progress = self.autopilot, self.autopilot.mission
        progress.released |= not autopilot.body.on_ground
        waiting = autopilot.spec.kind is Kind.COPTER and not progress.released
        if not progress.paused:
            self._paused_at = None
        elif self._paused_at is None:
            self._paused_at = HoldPosition(autopilot)
        if self._paused_at is not None:
            return self._paused_at.step(dt_s)
        if waiting or not progress.running:
            return self._stay.step(dt_s)
        self._notice_a_change()
        self._actions.step(dt_s)
        if self._leg is None or self._index is None:
            return self._stay.step(dt_s)
        setpoint = self._leg.step(dt_s)
        if self._leg is not None and self._leg.done:
            done, self._leg = self._index, None
            progress.reached(done)
            self.go_on(done + 1)
        return setpoint

    def go_on(self, index: int) -> None:
        """Begin the next item of navigation from there on, and the actions on the way to it."""
        autopilot, progress = self.autopilot, self.autopilot.mission
        actions, following = progress.advance(index)
        self._actions.begin(actions)
        self._stay = HoldPosition(autopilot)
        self._index = following
        if following is None:
            self.complete()
            return
        item = progress.items[following]
        progress.current = progress.resume_at = following
        self.tell(f"Mission: {following} {NAVIGATION[item.command]}")
        self._leg = leg_of(autopilot, item)
        self._ahead = self._next_items(following)

    def _notice_a_change(self) -> None:
        """ArduPilot begins a waypoint again when it or the next ones are replaced (ModeAuto)."""
        autopilot = self.autopilot
        looks = autopilot.firmware.is_ardupilot and autopilot.spec.kind is not Kind.PLANE
        if not looks or type(self._leg) is not Leg or self._index is None:
            return
        if self._ahead != self._next_items(self._index):
            autopilot.warn("Auto mission changed, restarted command")
            self.go_on(self._index)

    def _next_items(self, index: int) -> tuple[Item, ...]:
        return self.autopilot.mission.items[index : index + LOOKS_AHEAD]

    def tell(self, text: str) -> None:
        """PX4 says nothing on the way."""
        if self.autopilot.firmware.is_ardupilot:
            self.autopilot.say(text)

    def complete(self) -> None:
        """The end: a plane goes home, a copter that has landed stops its motors."""
        autopilot, progress = self.autopilot, self.autopilot.mission
        progress.complete, progress.running = True, False
        match autopilot.spec.kind:
            case Kind.PLANE:
                autopilot.modes.switch(autopilot.firmware.roles.rtl)
                self.tell("Mission complete, changing mode to RTL")
            case Kind.COPTER:
                if autopilot.body.on_ground:
                    autopilot.arming.disarm_after_landing()
            case _:
                self.tell("Mission Complete")


CHECKING_S = 0.2
"""Real ones take 0.1 s."""


class MissionAvailability(Component):
    """PX4 checks a new mission for a while; until then it cannot be flown."""

    def __init__(self, autopilot: AutopilotInterface) -> None:
        super().__init__(autopilot)
        self._items = autopilot.plans[MISSION]
        self._changed_s = autopilot.now_s - CHECKING_S

    @property
    def available(self) -> bool:
        """It may be flown."""
        autopilot = self.autopilot
        if self._items != autopilot.plans[MISSION]:
            self._items, self._changed_s = autopilot.plans[MISSION], autopilot.now_s
        return bool(self._items) and autopilot.now_s - self._changed_s >= CHECKING_S

    def step(self, dt_s: float) -> None:
        """Notice a new mission."""
        _ = self.available

    def refusals(self) -> Iterator[str]:
        """Without a mission it is not armed to fly one."""
        autopilot = self.autopilot
        if autopilot.modes.mode.number == autopilot.firmware.roles.mission and not self.available:
            yield "No valid mission available"


class Px4AutoMission(AutoMission):
    """AUTO.MISSION of PX4: flies the mission, and holds at its end; arming in it is enough to take
    off."""

    def refusal(self) -> str | None:
        """While nothing is armed, it may be chosen without a mission."""
        autopilot = self.autopilot
        ready = autopilot.component(MissionAvailability).available or not autopilot.arming.armed
        return None if ready else "no valid mission"

    def begin(self) -> None:
        """Armed, it begins."""
        if self.autopilot.arming.armed:
            self.autopilot.mission.released = True
            super().begin()

    def complete(self) -> None:
        """It is over when the actions behind the last item have been done."""
        self._actions.finish()
        self.autopilot.say("Mission finished, loitering")
        super().complete()

    def step(self, dt_s: float) -> MotionSetpoint:
        """Fly it; at its end, hold; an item that says so enters AUTO.RTL, and is the end."""
        autopilot, roles = self.autopilot, self.autopilot.firmware.roles
        if autopilot.mission.empty and not autopilot.body.on_ground:
            autopilot.warn("No valid mission available, loitering")
            return self.hand_over(roles.hold, dt_s)
        setpoint = super().step(dt_s)
        returns = isinstance(self._leg, Return)
        if returns and self._index is not None:
            autopilot.mission.reached(self._index)
            self._leg = None
            self.complete()
        if not (autopilot.mission.complete and autopilot.arming.armed):
            return setpoint
        setpoint = self.hand_over(roles.hold, dt_s)
        if returns:
            autopilot.say("Returning to launch")
            autopilot.modes.switch(roles.rtl)
            setpoint = autopilot.modes.maneuver.step(dt_s)
        return setpoint
