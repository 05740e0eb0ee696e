"""Clearing stored items, setting the current one, and reading a single one (mavlink.io,
"Mission Protocol", services/mission.html)."""

from abc import abstractmethod
from typing import TypeVar

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.microservices.commands import CommandExchange
from m2pem_plugin_mavlink.microservices.mission_items import (
    ACCEPTED,
    CANCELLED,
    ITEM_FLOAT,
    ITEM_INT,
    REQUEST_INT,
    MissionExchange,
    MissionItem,
    MissionType,
    item_of,
    mission_result_words,
    refusal,
)
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import RETRIES, NoAnswerError, RetryPolicy

T = TypeVar("T")

CLEAR_RETRIES = RetryPolicy(tries=5, answer_s=1.5)

_CLEAR = message_type("MISSION_CLEAR_ALL")
_ACK = message_type("MISSION_ACK")
_CURRENT = message_type("MISSION_CURRENT")
_SET_CURRENT = message_type("MISSION_SET_CURRENT")


class _Question(MissionExchange[T]):
    """A request that is repeated until it is answered. `title`: what was requested, for errors.

    Fails with `RefusedError` (a MAV_MISSION_RESULT) or `NoAnswerError`.
    """

    retry_policy: RetryPolicy
    title: str

    def __init__(self, target: Address, mission_type: MissionType) -> None:
        super().__init__(target, mission_type)
        self._tries = 0

    @abstractmethod
    def ask(self) -> None:
        """Send the request."""

    def begin(self, now_s: float) -> None:
        """Ask."""
        self._tries += 1
        self.ask()
        self.deadline_s = now_s + self.retry_policy.answer_s

    def expire(self, now_s: float) -> None:
        """Repeat the request, or fail."""
        if self._tries < self.retry_policy.tries:
            self.begin(now_s)
        else:
            asked = f"no answer after {self._tries} requests"
            self.fail(NoAnswerError(f"{self.title}: {asked}"))

    def refused(self, result: int) -> None:
        """Fail with a result of the vehicle."""
        self.fail(refusal(f"{self.title}: {mission_result_words(result)}", result))


class ClearMission(_Question[None]):
    """Removes all items. ArduPilot refuses while it executes them."""

    wants = frozenset({_ACK.id})
    retry_policy = CLEAR_RETRIES

    def __init__(self, target: Address, mission_type: MissionType = MissionType.MISSION) -> None:
        super().__init__(target, mission_type)
        self.title = f"clearing the {self.what}"

    def ask(self) -> None:
        self.send(_CLEAR)

    def receive(self, message: Message, sender: Address, now_s: float) -> None:
        """Process the acknowledgement or refusal."""
        if not self.is_expected(message, sender):
            return
        if message.type == ACCEPTED:
            self.succeed(None)
        elif message.type != CANCELLED:  # from an upload that has failed
            self.refused(message.type)


class SetCurrentItem(CommandExchange[None]):
    """Sets the current item of the stored mission by DO_SET_MISSION_CURRENT or, if that is not
    supported, by its predecessor; MISSION_CURRENT then confirms it."""

    wants = CommandExchange.wants | {_CURRENT.id}

    def __init__(self, target: Address, sequence: int) -> None:
        command = dialect.MAV_CMD_DO_SET_MISSION_CURRENT
        super().__init__(target, command, (sequence,))
        self.name = f"current item {sequence}"
        self._sequence = sequence
        self._by_message = False
        self._tries = 0

    def accepted(self, ack: Message, now_s: float) -> None:
        """End: the command is executed."""
        self.succeed(None)

    def refused(self, result: int, now_s: float) -> None:
        """Send the message to an autopilot that does not support the command."""
        if result == dialect.MAV_RESULT_UNSUPPORTED and not self._by_message:
            self._by_message = True
            self._send(now_s)
        elif not self._by_message:
            super().refused(result, now_s)

    def receive(self, message: Message, sender: Address, now_s: float) -> None:
        """Receive an acknowledgement or the current item."""
        if message.TYPE is not _CURRENT:
            super().receive(message, sender, now_s)
        elif self._by_message and (message.seq, sender) == (self._sequence, self.target):
            self.succeed(None)

    def expire(self, now_s: float) -> None:
        """Repeat the request, or fail."""
        if not self._by_message:
            super().expire(now_s)
        elif self._tries < self.retry_policy.tries:
            self._send(now_s)
        else:
            shown = "MISSION_CURRENT does not confirm it after"
            self.fail(NoAnswerError(f"{self.name}: {shown} {self._tries} requests"))

    def _send(self, now_s: float) -> None:
        self._tries += 1
        self.outbox.append(_SET_CURRENT.make(**self.target.as_target, seq=self._sequence))
        self.deadline_s = now_s + self.retry_policy.answer_s


class ReadMissionItem(_Question[MissionItem]):
    """Reads one stored item without a download, which ArduPilot allows (its item 0 is home) and PX4
    does not."""

    wants = frozenset({ITEM_INT.id, ITEM_FLOAT.id, _ACK.id})
    retry_policy = RETRIES

    def __init__(self, target: Address, sequence: int) -> None:
        super().__init__(target, MissionType.MISSION)
        self.title = f"item {sequence}"
        self._sequence = sequence

    def ask(self) -> None:
        self.send(REQUEST_INT, seq=self._sequence)

    def receive(self, message: Message, sender: Address, now_s: float) -> None:
        """Process the item, or a refusal."""
        if not self.is_expected(message, sender):
            return
        if message.TYPE is not _ACK:
            if message.seq == self._sequence:
                self.succeed(item_of(message))
        elif message.type not in (ACCEPTED, CANCELLED):  # these are from earlier exchanges
            self.refused(message.type)
