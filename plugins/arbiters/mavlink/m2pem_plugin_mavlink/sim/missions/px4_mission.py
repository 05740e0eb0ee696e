"""AUTO.MISSION of PX4: flies the mission, and holds at its end."""

from m2pem_plugin_mavlink.sim.demands import Demand
from m2pem_plugin_mavlink.sim.missions.availability import MissionAvailability
from m2pem_plugin_mavlink.sim.missions.execution import Auto
from m2pem_plugin_mavlink.sim.missions.legs import Return


class Px4Mission(Auto):
    """Being armed in it is enough to take off."""

    def refusal(self) -> str | None:
        """While nothing is armed, it may be chosen without a mission."""
        pilot = self.autopilot
        ready = pilot.part(MissionAvailability).available or not pilot.arming.armed
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

    def step(self, dt_s: float) -> Demand:
        """Fly it; at its end, hold; an item that says so enters AUTO.RTL, and is the end."""
        pilot, roles = self.autopilot, self.autopilot.firmware.roles
        if pilot.mission.empty and not pilot.body.on_ground:
            pilot.warn("No valid mission available, loitering")
            return self.hand_over(roles.hold, dt_s)
        demand = super().step(dt_s)
        returns = isinstance(self._leg, Return)
        if returns and self._index is not None:
            pilot.mission.reached(self._index)
            self._leg = None
            self.complete()
        if not (pilot.mission.complete and pilot.arming.armed):
            return demand
        demand = self.hand_over(roles.hold, dt_s)
        if returns:
            pilot.say("Returning to launch")
            pilot.modes.switch(roles.back)
            demand = pilot.modes.maneuver.step(dt_s)
        return demand
