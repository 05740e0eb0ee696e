"""Servos, relays and grippers."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.sim.command import Command, Result
from m2pem_plugin_mavlink.sim.part import CommandHandler, Part, ReportMaker

if TYPE_CHECKING:
    from m2pem_plugin_mavlink.sim.autopilot import Autopilot

SERVOS, RELAYS = 16, 6
LONGEST_PULSE_US = 20_000
RESERVED_SERVOS = 4
"""The first outputs drive motors; they cannot be set."""


class Payload(Part):
    """`servos_us`: pulse widths by output; `relays`: on or off; `gripped`: gripper closed."""

    def __init__(self, autopilot: "Autopilot") -> None:
        super().__init__(autopilot)
        self.servos_us: dict[int, int] = {}
        self.relays: dict[int, bool] = {}
        self.gripped = True

    def set_servo(self, output: int, pulse_us: int) -> bool:
        """Set an output, if it is free."""
        if not RESERVED_SERVOS < output <= SERVOS:
            self.autopilot.warn(f"ServoRelayEvent: Channel {output} is already in use")
            return False
        if not 0 <= pulse_us <= LONGEST_PULSE_US:
            return False
        self.servos_us[output] = pulse_us
        self.autopilot.note("servo", f"{output}={pulse_us}")
        return True

    def set_relay(self, relay: int, on: bool) -> bool:
        """Switch a relay."""
        if not 0 <= relay < RELAYS:
            return False
        self.relays[relay] = on
        self.autopilot.note("relay", f"{relay}={on:d}")
        return True

    def set_gripper(self, grab: bool) -> bool:
        """Open or close the gripper."""
        self.gripped = grab
        self.autopilot.note("gripper", "grab" if grab else "release")
        self.autopilot.say("Gripper load grabbed" if grab else "Gripper load released")
        return True

    def commands(self) -> Mapping[int, CommandHandler]:
        """DO_SET_SERVO, DO_SET_RELAY, DO_GRIPPER."""
        return {
            dialect.MAV_CMD_DO_SET_SERVO: lambda command: _result(
                self.set_servo(int(command.param1), int(command.param2))
            ),
            dialect.MAV_CMD_DO_SET_RELAY: lambda command: _result(
                self.set_relay(int(command.param1), command.param2 > 0)
            ),
            dialect.MAV_CMD_DO_GRIPPER: self._gripper,
        }

    def _gripper(self, command: Command) -> Result:
        if command.param2 not in (0, 1):
            return Result.DENIED
        return _result(self.set_gripper(command.param2 == 1))

    def reports(self) -> Mapping[int, ReportMaker]:
        """SERVO_OUTPUT_RAW."""
        return {dialect.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: self._outputs}

    def _outputs(self) -> Any:
        running = 1500 if self.autopilot.arming.armed else 1000
        pulses = [running] * RESERVED_SERVOS
        pulses += [self.servos_us.get(output, 0) for output in range(RESERVED_SERVOS + 1, 17)]
        time_us = int(self.autopilot.since_boot_s * 1e6) & 0xFFFFFFFF
        return dialect.MAVLink_servo_output_raw_message(time_us, 0, *pulses)


def _result(done: bool) -> Result:
    result = Result.ACCEPTED if done else Result.FAILED
    return result
