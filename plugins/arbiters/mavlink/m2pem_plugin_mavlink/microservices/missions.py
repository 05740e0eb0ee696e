"""Clearing stored items, setting the current one, and reading a single one (mavlink.io,
"Mission Protocol", services/mission.html)."""

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.microservices.commands import CommandExchange
from m2pem_plugin_mavlink.microservices.mission_download import item_request
from m2pem_plugin_mavlink.microservices.mission_items import (
    ACCEPTED,
    CANCELLED,
    ITEM_FLOAT,
    ITEM_INT,
    MissionItem,
    MissionType,
    is_temporary,
    item_of,
    mission_result_words,
)
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import (
    RETRIES,
    NoAnswerError,
    RefusedError,
    RetryPolicy,
    Transaction,
)

CLEAR_RETRIES = RetryPolicy(tries=5, answer_s=1.5)

_CLEAR = message_type("MISSION_CLEAR_ALL")
_ACK = message_type("MISSION_ACK")
_CURRENT = message_type("MISSION_CURRENT")
_SET_CURRENT = message_type("MISSION_SET_CURRENT")


class ClearMission(Transaction[None]):
    """Removes all items. ArduPilot refuses while it executes them.

    Fails with `RefusedError` (a MAV_MISSION_RESULT) or `NoAnswerError`.
    """

    wants = frozenset({_ACK.id})

    def __init__(self, target: Address, mission_type: MissionType = MissionType.MISSION) -> None:
        super().__init__(("mission", target))
        self.target, self.mission_type = target, mission_type
        self._tries = 0

    def begin(self, now_s: float) -> None:
        """Ask."""
        self._tries += 1
        self.outbox.append(
            _CLEAR.make(
                target_system=self.target.system,
                target_component=self.target.component,
                mission_type=self.mission_type,
            )
        )
        self.deadline_s = now_s + CLEAR_RETRIES.answer_s

    def receive(self, message: Message, sender: Address, now_s: float) -> None:
        """Process the acknowledgement or refusal."""
        is_expected = sender == self.target and message.mission_type == self.mission_type
        if not is_expected or not self.for_us(message):
            return
        if message.type == ACCEPTED:
            self.succeed(None)
        elif message.type != CANCELLED:  # from an upload that has failed
            reason = f"clearing the {self.mission_type.name.lower()}: "
            reason += mission_result_words(message.type)
            self.fail(RefusedError(reason, message.type, temporary=is_temporary(message.type)))

    def expire(self, now_s: float) -> None:
        """Repeat the request, or fail."""
        if self._tries < CLEAR_RETRIES.tries:
            self.begin(now_s)
            return
        what = f"clearing the {self.mission_type.name.lower()}"
        self.fail(NoAnswerError(f"{what}: no answer after {self._tries} requests"))


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
        self.outbox.append(
            _SET_CURRENT.make(
                seq=self._sequence,
                target_system=self.target.system,
                target_component=self.target.component,
            )
        )
        self.deadline_s = now_s + self.retry_policy.answer_s


class ReadMissionItem(Transaction[MissionItem]):
    """Reads one stored item without a download, which ArduPilot allows (its item 0 is home) and PX4
    does not.

    Fails with `RefusedError` (a MAV_MISSION_RESULT) or `NoAnswerError`.
    """

    wants = frozenset({ITEM_INT.id, ITEM_FLOAT.id, _ACK.id})

    def __init__(
        self,
        target: Address,
        sequence: int,
        mission_type: MissionType = MissionType.MISSION,
    ) -> None:
        super().__init__(("mission", target))
        self.target, self.mission_type = target, mission_type
        self._sequence = sequence
        self._tries = 0

    def begin(self, now_s: float) -> None:
        """Ask."""
        self._tries += 1
        self.outbox.append(item_request(self.target, self._sequence, self.mission_type))
        self.deadline_s = now_s + RETRIES.answer_s

    def receive(self, message: Message, sender: Address, now_s: float) -> None:
        """Process the item, or a refusal."""
        is_expected = sender == self.target and message.mission_type == self.mission_type
        if not is_expected or not self.for_us(message):
            return
        if message.TYPE is not _ACK:
            if message.seq == self._sequence:
                self.succeed(item_of(message))
        elif message.type not in (ACCEPTED, CANCELLED):  # these are from earlier exchanges
            reason = f"item {self._sequence}: {mission_result_words(message.type)}"
            self.fail(RefusedError(reason, message.type, temporary=is_temporary(message.type)))

    def expire(self, now_s: float) -> None:
        """Repeat the request, or fail."""
        if self._tries < RETRIES.tries:
            self.begin(now_s)
        else:
            asked = f"no answer after {self._tries} requests"
            self.fail(NoAnswerError(f"item {self._sequence}: {asked}"))
