"""AUTO.MISSION of PX4: flies the mission, and holds at its end."""

from collections.abc import Iterator

from m2pem_plugin_mavlink.simulator.dynamics import MotionSetpoint
from m2pem_plugin_mavlink.simulator.interfaces import AutopilotInterface, Component
from m2pem_plugin_mavlink.simulator.missions.execution import AutoMission
from m2pem_plugin_mavlink.simulator.missions.legs import Return
from m2pem_plugin_mavlink.simulator.missions.plan import MISSION

CHECKING_S = 0.2
"""Real ones take 0.1 s."""


class MissionAvailability(Component):
    """Whether there is a mission that was found good."""

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
    """Being armed in it is enough to take off."""

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
