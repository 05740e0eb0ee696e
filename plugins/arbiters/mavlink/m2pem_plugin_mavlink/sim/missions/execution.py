"""AUTO: flying the mission, item by item."""

from pymavlink.dialects.v20.ardupilotmega import MAV_SEVERITY_NOTICE

from m2pem_plugin_mavlink.sim.demands import Demand
from m2pem_plugin_mavlink.sim.maneuvers.maneuver import Maneuver
from m2pem_plugin_mavlink.sim.maneuvers.standing import Stay
from m2pem_plugin_mavlink.sim.missions.actions import Actions
from m2pem_plugin_mavlink.sim.missions.items import NAVIGATION
from m2pem_plugin_mavlink.sim.missions.legs import NAV_TAKEOFF, Leg, leg_of
from m2pem_plugin_mavlink.sim.missions.plan import Item
from m2pem_plugin_mavlink.sim.specification import Kind

LOOKS_AHEAD = 3
"""So many items are watched for changes (Mission_Change_Detector)."""


class Auto(Maneuver):
    """Flies the mission from where it was; complete, it begins anew when the mode is left and
    entered again, and not before (ArduPilot: AP_Mission::start_or_resume)."""

    paused = False
    _leg: Leg | None = None
    _index: int | None = None
    _ahead: tuple[Item, ...] = ()

    @property
    def takes_speed(self) -> bool:
        """Always, but boats that keep their station."""
        return self._leg is not None or self.autopilot.spec.kind is not Kind.BOAT

    def refusal(self) -> str | None:
        """An armed copter on the ground needs a mission that begins with a takeoff; what drives
        needs one even while it is not armed."""
        pilot, progress = self.autopilot, self.autopilot.mission
        surface = pilot.spec.kind in (Kind.ROVER, Kind.BOAT)
        if not (pilot.arming.armed or surface):
            return None
        if progress.empty:
            if surface:
                pilot.say("No Mission. Can't set AUTO.", MAV_SEVERITY_NOTICE)
            return "init failed"
        if pilot.spec.kind is Kind.COPTER and pilot.body.on_ground:
            ahead = progress.items[self._start() :]
            first = next((item.command for item in ahead if item.command in NAVIGATION), None)
            if first != NAV_TAKEOFF:
                pilot.warn("Auto: Missing Takeoff Cmd")
                return "init failed"
        return None

    def _start(self) -> int:
        """The item to begin with."""
        pilot, progress = self.autopilot, self.autopilot.mission
        # A new plan may be shorter than the one in which it was.
        known = progress.first <= progress.resume_at < len(progress.items)
        again = progress.complete or not known
        if again or pilot.parameters.get("MIS_RESTART") == 1:
            return progress.first
        return progress.resume_at

    def begin(self) -> None:
        """Start or go on, armed or not; what goes on already does so when it is armed."""
        self._stay = Stay(self.autopilot)
        if not self.autopilot.mission.running:
            self.start()

    def start(self) -> None:
        """Begin the mission, or go on where it was."""
        pilot, progress = self.autopilot, self.autopilot.mission
        self._actions = Actions(pilot)
        start = self._start()
        if progress.complete or start == progress.first:
            progress.restart()
            pilot.note("mission", f"{len(progress.items)} items")
        progress.running = progress.begun = True
        progress.complete = False
        self.go_on(start)

    def pause(self, *, on: bool) -> None:
        """Stop on the way, or go on."""
        self.paused = on
        self._stay = Stay(self.autopilot)

    def end(self) -> None:
        """Another mode has been entered."""
        self.autopilot.mission.running = False

    def step(self, dt_s: float) -> Demand:
        """Fly the present leg, and go on to the next when it is done."""
        pilot, progress = self.autopilot, self.autopilot.mission
        progress.released |= not pilot.body.on_ground
        waiting = pilot.spec.kind is Kind.COPTER and not progress.released
        if waiting or not progress.running:
            return self._stay.step(dt_s)
        self._notice_a_change()
        self._actions.step(dt_s)
        if self._leg is None or self._index is None or self.paused:
            return self._stay.step(dt_s)
        demand = self._leg.step(dt_s)
        if self._leg is not None and self._leg.done:
            done, self._leg = self._index, None
            progress.reached(done)
            self.go_on(done + 1)
        return demand

    def go_on(self, index: int) -> None:
        """Begin the next item of navigation from there on, and the actions on the way to it."""
        pilot, progress = self.autopilot, self.autopilot.mission
        actions, following = progress.advance(index)
        self._actions.begin(actions)
        self._stay = Stay(pilot)
        self._index = following
        if following is None:
            self.complete()
            return
        item = progress.items[following]
        progress.current = progress.resume_at = following
        self.tell(f"Mission: {following} {NAVIGATION[item.command]}")
        self._leg = leg_of(pilot, item)
        self._ahead = self._next_items(following)

    def _notice_a_change(self) -> None:
        """ArduPilot begins a waypoint again when it or the next ones are replaced (ModeAuto)."""
        pilot = self.autopilot
        looks = pilot.firmware.is_ardupilot and pilot.spec.kind is not Kind.PLANE
        if not looks or type(self._leg) is not Leg or self._index is None:
            return
        if self._ahead != self._next_items(self._index):
            pilot.warn("Auto mission changed, restarted command")
            self.go_on(self._index)

    def _next_items(self, index: int) -> tuple[Item, ...]:
        return self.autopilot.mission.items[index : index + LOOKS_AHEAD]

    def tell(self, text: str) -> None:
        """PX4 says nothing on the way."""
        if self.autopilot.firmware.is_ardupilot:
            self.autopilot.say(text)

    def complete(self) -> None:
        """The end: a plane goes home, a copter that has landed stops its motors."""
        pilot, progress = self.autopilot, self.autopilot.mission
        progress.complete, progress.running = True, False
        match pilot.spec.kind:
            case Kind.PLANE:
                pilot.modes.switch(pilot.firmware.roles.back)
                self.tell("Mission complete, changing mode to RTL")
            case Kind.COPTER:
                if pilot.body.on_ground:
                    pilot.arming.disarm_after_landing()
            case _:
                self.tell("Mission Complete")
