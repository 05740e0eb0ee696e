"""Commands (MAV_CMD): receiving and acknowledging them; reboot, servos, relays and grippers."""

from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.simulator.interfaces import (
    AutopilotInterface,
    CommandHandler,
    Component,
    on_command,
    on_message,
)
from m2pem_plugin_mavlink.simulator.messages import Command, Result, Sender, command_of

REPEAT_S = 10.0
"""A repetition (`confirmation` > 0) within that time gets the answer of the first."""

CommandKey = tuple[Sender, int]


class CommandServer(Component):
    """Executes and acknowledges commands. `handlers`: by MAV_CMD; all others are UNSUPPORTED."""

    def __init__(self, autopilot: AutopilotInterface, component: int = 1) -> None:
        super().__init__(autopilot)
        self.component_id = component
        self.handlers: dict[int, CommandHandler] = {}
        self._answers: dict[CommandKey, tuple[float, tuple[Any, ...], Result]] = {}

    @on_message("COMMAND_LONG", "COMMAND_INT")
    def _receive(self, message: Any, sender: Sender) -> None:
        command = command_of(message, sender)
        refusal = self.autopilot.injected_faults.refusal_of(command.id)
        result = self._repeated(command)
        if refusal is not None:
            if refusal.text:
                self.autopilot.warn(refusal.text)
            if refusal.result is None:
                return
            result = refusal.result
        elif result is None:
            result = self.perform(command)
            if len(self._answers) > 200:
                self._answers.clear()
            answer = (self.autopilot.now_s, self._content(command), result)
            self._answers[sender, command.id] = answer
        self.autopilot.send(
            dialect.MAVLink_command_ack_message(
                command.id, result, 0, 0, sender.system, sender.component
            ),
            sender.peer,
            self.component_id,
        )

    def perform(self, command: Command) -> Result:
        """Call the handler of a command."""
        handler = self.handlers.get(command.id)
        if handler is None:
            return Result.UNSUPPORTED
        try:
            return handler(command)
        except (ValueError, OverflowError):
            # Whole numbers were expected where there is NaN or infinity.
            return Result.DENIED

    def _repeated(self, command: Command) -> Result | None:
        """Return the acknowledgement of the same command from a moment ago, if this one is a
        repetition."""
        before = self._answers.get((command.sender, command.id))
        if not command.confirmation or before is None:
            return None
        at_s, content, result = before
        recent = self.autopilot.now_s - at_s <= REPEAT_S
        accepted = result == Result.ACCEPTED
        return result if recent and accepted and content == self._content(command) else None

    @staticmethod
    def _content(command: Command) -> tuple[Any, ...]:
        parameters = (command.param1, command.param2, command.param3, command.param4)
        # NaN is unequal to itself; its text is not.
        return tuple(
            map(repr, (*parameters, command.latitude_deg, command.longitude_deg, command.z))
        )


REBOOTS = (1, 3)
"""Parameter 1: reboot, or reboot into the bootloader (which then starts the firmware)."""


class SystemCommands(Component):
    """Reboots the autopilot."""

    rebooting = False

    @on_command(dialect.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN)
    def _reboot(self, command: Command) -> Result:
        if command.param1 not in REBOOTS:
            return Result.UNSUPPORTED
        if self.autopilot.arming.armed:
            return Result.FAILED if self.autopilot.firmware.is_ardupilot else Result.DENIED
        self.rebooting = True
        return Result.ACCEPTED

    def step(self, dt_s: float) -> None:
        """Reboot one step later, so that the acknowledgement is sent before."""
        if self.rebooting:
            self.rebooting = False
            self.autopilot.reboot()


SERVOS, RELAYS = 16, 6
LONGEST_PULSE_US = 20_000
RESERVED_SERVOS = 4
"""The first outputs drive motors; they cannot be set."""


class Payload(Component):
    """`servos_us`: pulse widths by output; `relays`: on or off; `gripped`: gripper closed."""

    def __init__(self, autopilot: AutopilotInterface) -> None:
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
        self.autopilot.log_event("servo", f"{output}={pulse_us}")
        return True

    def set_relay(self, relay: int, on: bool) -> bool:
        """Switch a relay."""
        if not 0 <= relay < RELAYS:
            return False
        self.relays[relay] = on
        self.autopilot.log_event("relay", f"{relay}={on:d}")
        return True

    def set_gripper(self, grab: bool) -> bool:
        """Open or close the gripper."""
        self.gripped = grab
        self.autopilot.log_event("gripper", "grab" if grab else "release")
        self.autopilot.say("Gripper load grabbed" if grab else "Gripper load released")
        return True

    @on_command(dialect.MAV_CMD_DO_SET_SERVO)
    def _servo(self, command: Command) -> Result:
        return _result(self.set_servo(int(command.param1), int(command.param2)))

    @on_command(dialect.MAV_CMD_DO_SET_RELAY)
    def _relay(self, command: Command) -> Result:
        return _result(self.set_relay(int(command.param1), command.param2 > 0))

    @on_command(dialect.MAV_CMD_DO_GRIPPER)
    def _gripper(self, command: Command) -> Result:
        if command.param2 not in (0, 1):
            return Result.DENIED
        return _result(self.set_gripper(command.param2 == 1))


def _result(done: bool) -> Result:
    return Result.ACCEPTED if done else Result.FAILED
