"""AUTO: flying the mission, item by item."""

from m2pem_plugin_mavlink.sim.demands import Demand
from m2pem_plugin_mavlink.sim.maneuvers.maneuver import Maneuver
from m2pem_plugin_mavlink.sim.maneuvers.standing import Stay
from m2pem_plugin_mavlink.sim.missions.actions import Actions
from m2pem_plugin_mavlink.sim.missions.items import NAVIGATION
from m2pem_plugin_mavlink.sim.missions.legs import Leg, leg_of
from m2pem_plugin_mavlink.sim.specification import Kind

NAV_TAKEOFF = 22


class Auto(Maneuver):
    """Flies the mission from its current item on; complete, it begins anew when entered again."""

    paused = False

    def refusal(self) -> str | None:
        """An armed copter on the ground needs a mission that begins with a takeoff."""
        pilot, progress = self.autopilot, self.autopilot.mission
        if not pilot.arming.armed:
            return None
        if progress.empty:
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
        known = progress.first <= progress.current < len(progress.items)
        again = progress.complete or not known
        if again or pilot.parameters.get("MIS_RESTART") == 1:
            return progress.first
        return progress.current

    def begin(self) -> None:
        """Go on with the current item, once armed."""
        self._leg: Leg | None = None
        self._index: int | None = None
        self._actions = Actions(self.autopilot)
        self._stay = Stay(self.autopilot)

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
        waiting = pilot.spec.kind is Kind.COPTER and pilot.body.on_ground and not progress.released
        if progress.empty or waiting:
            return self._stay.step(dt_s)
        if not progress.running:
            # Complete, and entered anew: it begins again.
            progress.running, progress.redirected = True, False
            if progress.complete:
                progress.restart()
        if progress.redirected:
            progress.redirected = False
            self._go_on(progress.current)
        elif self._index is None and not progress.complete:
            self._open()
        self._actions.step(dt_s)
        if self._leg is None or self._index is None or self.paused:
            return self._stay.step(dt_s)
        demand = self._leg.step(dt_s)
        if self._leg.done:
            done, self._leg = self._index, None
            progress.reached(done)
            self._go_on(done + 1)
        return demand

    def _open(self) -> None:
        """Begin where the mission is to begin."""
        pilot, progress = self.autopilot, self.autopilot.mission
        start = self._start()
        if start == progress.first:
            progress.restart()
            pilot.note("mission", f"{len(progress.items)} items")
        progress.begun, progress.complete = True, False
        self._go_on(start)

    def _go_on(self, index: int) -> None:
        """Begin the next item of navigation from there on, and the actions on the way to it."""
        pilot, progress = self.autopilot, self.autopilot.mission
        actions, following = progress.advance(index)
        self._actions.begin(actions)
        self._stay = Stay(pilot)
        self._index = following
        if following is None:
            progress.complete = True
            if pilot.spec.kind is Kind.PLANE:
                pilot.say("Mission complete, changing mode to RTL")
                pilot.modes.switch(pilot.firmware.roles.back)
                return
            pilot.say("Mission complete")
            if pilot.body.on_ground and pilot.spec.kind is Kind.COPTER:
                pilot.arming.disarm_after_landing()
            return
        item = progress.items[following]
        progress.current = following
        pilot.say(f"Mission: {following} {NAVIGATION[item.command]}")
        self._leg = leg_of(pilot, item)
        if item.command == NAV_TAKEOFF and pilot.body.on_ground:
            pilot.note("takeoff", f"item {following}")
