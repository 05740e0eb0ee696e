"""Commands to the autopilot as a computer: reboot."""

from collections.abc import Mapping

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.sim.command import Command, Result
from m2pem_plugin_mavlink.sim.part import CommandHandler, Part

REBOOTS = (1, 3)
"""Parameter 1: reboot, or reboot into the bootloader (which then starts the firmware)."""


class SystemCommands(Part):
    """Restarts it."""

    rebooting = False

    def commands(self) -> Mapping[int, CommandHandler]:
        """Reboot."""
        return {dialect.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: self._reboot}

    def _reboot(self, command: Command) -> Result:
        if command.param1 not in REBOOTS:
            return Result.UNSUPPORTED
        if self.autopilot.arming.armed:
            return Result.FAILED if self.autopilot.firmware.is_ardupilot else Result.DENIED
        self.rebooting = True
        return Result.ACCEPTED

    def step(self, dt_s: float) -> None:
        """The answer goes out first."""
        if self.rebooting:
            self.rebooting = False
            self.autopilot.reboot()
