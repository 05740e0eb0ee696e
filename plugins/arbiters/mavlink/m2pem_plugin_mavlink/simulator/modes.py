"""Changing modes: the present mode and its maneuver."""

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.simulator.dynamics import NoThrust
from m2pem_plugin_mavlink.simulator.interfaces import (
    AutopilotInterface,
    Component,
    Maneuver,
    Mode,
    on_command,
)
from m2pem_plugin_mavlink.simulator.messages import Command, Result


class ModeSwitch(Component):
    """The mode, and its maneuver.

    `speed_mps`: how fast maneuvers go; `reverse`: a rover drives backwards. Both are as the
    firmware has it whenever a mode is entered.
    """

    mode: Mode
    maneuver: Maneuver
    reverse = False

    def __init__(self, autopilot: AutopilotInterface) -> None:
        super().__init__(autopilot)
        self.by_number = {mode.number: mode for mode in autopilot.firmware.modes()}
        self._speed_mps: float | None = None

    def start(self) -> None:
        """Enter the first mode after the start."""
        self._enter(self.by_number[self.autopilot.firmware.first_mode], announce=False)

    @property
    def speed_mps(self) -> float:
        """The speed that was set since the mode was entered, or the one of the parameters."""
        if self._speed_mps is not None:
            return self._speed_mps
        return self.autopilot.tuning.cruise_mps

    def set_speed(self, speed_mps: float | None) -> None:
        """Set the speed for this mode; None: the one of the parameters."""
        self._speed_mps = speed_mps

    def switch(self, number: int) -> bool:
        """Enter a mode, or send a text with the reason against it; return True also in the present
        mode."""
        mode = self.by_number.get(number)
        if mode is None:
            self.autopilot.warn(f"No such mode {number}")
            return False
        if mode is self.mode:
            return True
        maneuver = mode.maneuver(self.autopilot)
        reason = self._refusal(mode) or maneuver.refusal()
        if reason is not None:
            text = self.autopilot.firmware.mode_text(mode, reason)
            self.autopilot.say(text, dialect.MAV_SEVERITY_WARNING)
            return False
        self._enter(mode, maneuver)
        return True

    def _refusal(self, mode: Mode) -> str | None:
        estimator = self.autopilot.estimator
        if not mode.needs_position or estimator.ready:
            return None
        # As long as nothing is armed, no harm is done, once it knows its attitude.
        harmless = estimator.levelled and not self.autopilot.arming.armed
        return None if harmless else "requires position"

    def _enter(self, mode: Mode, maneuver: Maneuver | None = None, announce: bool = True) -> None:
        if announce:
            self.maneuver.end()
        self.mode = mode
        self._speed_mps, self.reverse = None, False
        self.maneuver = maneuver or mode.maneuver(self.autopilot)
        self.maneuver.begin()
        if announce:
            self.autopilot.log_event("mode", mode.name)
            self.autopilot.firmware.mode_entered(self.autopilot)

    def step(self, dt_s: float) -> None:
        """Take the setpoint of the maneuver."""
        armed = self.autopilot.arming.armed
        self.autopilot.setpoint = self.maneuver.step(dt_s) if armed else NoThrust()

    @on_command(dialect.MAV_CMD_DO_SET_MODE)
    def _command(self, command: Command) -> Result:
        number = self.autopilot.firmware.mode_number(
            int(command.param1), int(command.param2), int(command.param3)
        )
        if number is None:
            return Result.DENIED
        switched = self.switch(number)
        return Result.ACCEPTED if switched else Result.FAILED
