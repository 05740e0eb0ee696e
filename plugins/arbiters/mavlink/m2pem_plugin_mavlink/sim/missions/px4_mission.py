"""AUTO.MISSION of PX4: flies the mission, and holds at its end."""

from m2pem_plugin_mavlink.sim.demands import Demand
from m2pem_plugin_mavlink.sim.missions.availability import MissionAvailability
from m2pem_plugin_mavlink.sim.missions.execution import Auto


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
        super().complete()

    def step(self, dt_s: float) -> Demand:
        """Fly it; at its end, hold."""
        demand = super().step(dt_s)
        pilot = self.autopilot
        if pilot.mission.complete and pilot.arming.armed:
            return self.hand_over(pilot.firmware.roles.hold, dt_s)
        return demand
