"""Arming and disarming, and the checks before."""

from collections.abc import Iterator

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.simulator.interfaces import AutopilotInterface, Component, on_command
from m2pem_plugin_mavlink.simulator.messages import Command, Result
from m2pem_plugin_mavlink.simulator.specification import SURFACE, Kind

FORCE_ARM, FORCE = 2989, 21196
"""Parameter 2 of MAV_CMD_COMPONENT_ARM_DISARM: do it in spite of everything."""
COMMANDED = "external command"
"""A reason to arm or to disarm, as PX4 words it."""


class Arming(Component):
    """Whether motors may turn."""

    def __init__(self, autopilot: AutopilotInterface) -> None:
        super().__init__(autopilot)
        self.armed = False
        self._idle_s = 0.0

    def reasons(self) -> Iterator[str]:
        """Yield the reasons against arming in the present mode, the most important first."""
        mode = self.autopilot.modes.mode
        if not mode.armable:
            named = self.autopilot.spec.kind not in SURFACE
            yield f"{mode.name} mode not armable" if named else "Mode not armable"
        for component in self.autopilot.components:
            yield from component.refusals()

    def refusals(self) -> Iterator[str]:
        """Yield the injected faults, and what the estimator lacks."""
        estimator, mode = self.autopilot.estimator, self.autopilot.modes.mode
        if self.autopilot.injected_faults.arming is not None:
            yield self.autopilot.injected_faults.arming
        if not estimator.sensors_well and self.autopilot.firmware.checks_sensors(self.autopilot):
            yield self.autopilot.firmware.reason_sensors
        if mode.needs_position and not estimator.ready:
            firmware = self.autopilot.firmware
            if estimator.gps_lost and firmware.reason_satellites:
                yield firmware.reason_satellites
            else:
                yield firmware.reason_position if estimator.sensors_well else firmware.reason_home

    @property
    def healthy(self) -> bool:
        """Whether there is no reason against arming (the bit PREARM_CHECK of SYS_STATUS)."""
        return next(self.reasons(), None) is None

    def arm(self, *, force: bool = False, by: str = COMMANDED) -> bool:
        """Arm, or send texts with the reasons against it; return True also if it was armed before.
        `by`: the reason."""
        if self.armed:
            return True
        reasons = [] if force else list(self.reasons())
        if reasons and self.autopilot.firmware.arming_denied:
            self.autopilot.warn(self.autopilot.firmware.arming_denied)
        for reason in reasons:
            self.autopilot.warn(self.autopilot.firmware.arming_text(reason))
        if reasons:
            return False
        self.armed, self._idle_s = True, 0.0
        self.autopilot.log_event("armed")
        self.autopilot.home.set_at_arming()
        self.autopilot.modes.maneuver.begin()
        self.autopilot.say(self.autopilot.firmware.armed_text.format(by))
        return True

    def disarm(self, *, force: bool = False, by: str = COMMANDED) -> bool:
        """Stop the motors; not in flight, unless forced. `by`: the reason."""
        if not self.armed:
            return True
        surface = self.autopilot.spec.kind in SURFACE
        if not (force or surface or self.autopilot.body.on_ground):
            return False
        self.armed = False
        self.autopilot.mission.disarmed()
        self.autopilot.log_event("disarmed")
        self.autopilot.say(self.autopilot.firmware.disarmed_text.format(by))
        return True

    def disarm_after_landing(self) -> None:
        """Disarm after a landing."""
        if self.armed:
            self.autopilot.log_event("landed")
            self.disarm(by="landing")

    def step(self, dt_s: float) -> None:
        """Disarm a copter that stays on the ground for DISARM_DELAY."""
        autopilot = self.autopilot
        delay_s = autopilot.tuning.disarm_delay_s
        flies = autopilot.spec.kind is Kind.COPTER
        if not (self.armed and flies and autopilot.body.on_ground and delay_s > 0):
            self._idle_s = 0.0
            return
        self._idle_s += dt_s
        if self._idle_s >= delay_s:
            self.disarm(by="auto preflight disarming")

    @on_command(dialect.MAV_CMD_COMPONENT_ARM_DISARM)
    def _command(self, command: Command) -> Result:
        force = command.param2 in (FORCE, FORCE_ARM)
        if command.param1 == 1:
            done = self.arm(force=force)
        elif command.param1 == 0:
            done = self.disarm(force=command.param2 == FORCE)
        else:
            return Result.UNSUPPORTED
        return Result.ACCEPTED if done else Result.FAILED

    @on_command(dialect.MAV_CMD_RUN_PREARM_CHECKS)
    def _check(self, command: Command) -> Result:
        if self.armed:
            return Result.TEMPORARILY_REJECTED
        for reason in self.reasons():
            self.autopilot.warn(self.autopilot.firmware.check_text(reason))
        return Result.ACCEPTED
