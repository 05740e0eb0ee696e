"""COMMAND_LONG and COMMAND_INT: each gets its handler and its COMMAND_ACK, and is done once."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.sim.command import Command, Result, command_of
from m2pem_plugin_mavlink.sim.part import CommandHandler, MessageHandler, Part
from m2pem_plugin_mavlink.sim.peers import Heard

if TYPE_CHECKING:
    from m2pem_plugin_mavlink.sim.autopilot import Autopilot

REPEAT_S = 10.0
"""A repetition (`confirmation` > 0) within that time gets the answer of the first."""

Told = tuple[Heard, int]


class CommandServer(Part):
    """Answers commands. `handlers`: by MAV_CMD; whoever is not there is UNSUPPORTED."""

    def __init__(self, autopilot: "Autopilot") -> None:
        super().__init__(autopilot)
        self.handlers: dict[int, CommandHandler] = {}
        self._answers: dict[Told, tuple[float, tuple[Any, ...], Result]] = {}

    def messages(self) -> Mapping[str, MessageHandler]:
        """Both kinds of commands."""
        return {"COMMAND_LONG": self._receive, "COMMAND_INT": self._receive}

    def _receive(self, message: Any, sender: Heard) -> None:
        command = command_of(message, sender)
        result = self._repeated(command)
        if result is None:
            result = self.perform(command)
            if len(self._answers) > 200:
                self._answers.clear()
            told = (self.autopilot.now_s, self._content(command), result)
            self._answers[sender, command.id] = told
        self.autopilot.send(
            dialect.MAVLink_command_ack_message(
                command.id, result, 0, 0, sender.system, sender.component
            ),
            sender.peer,
        )

    def perform(self, command: Command) -> Result:
        """Let the handler do it."""
        handler = self.handlers.get(command.id)
        if handler is None:
            return Result.UNSUPPORTED
        try:
            return handler(command)
        except (ValueError, OverflowError):
            # Whole numbers were expected where there is NaN or infinity.
            return Result.DENIED

    def _repeated(self, command: Command) -> Result | None:
        """The answer that the same command got just now, if it comes once more."""
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
