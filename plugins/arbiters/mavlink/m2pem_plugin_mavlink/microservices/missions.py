"""Clearing what is stored, choosing the current item, and reading a single one (mavlink.io,
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

CLEAR_PATIENCE = RetryPolicy(tries=5, answer_s=1.5)

_CLEAR = message_type("MISSION_CLEAR_ALL")
_ACK = message_type("MISSION_ACK")
_CURRENT = message_type("MISSION_CURRENT")
_SET_CURRENT = message_type("MISSION_SET_CURRENT")


class ClearMission(Transaction[None]):
    """Remove all items. ArduPilot refuses it while it flies them.

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
        self.deadline_s = now_s + CLEAR_PATIENCE.answer_s

    def receive(self, message: Message, sender: Address, now_s: float) -> None:
        """Done or refused."""
        is_ours = sender == self.target and message.mission_type == self.mission_type
        if not is_ours or not self.for_us(message):
            return
        if message.type == ACCEPTED:
            self.succeed(None)
        elif message.type != CANCELLED:  # of an upload that was given up
            reason = f"clearing the {self.mission_type.name.lower()}: "
            reason += mission_result_words(message.type)
            self.fail(RefusedError(reason, message.type, temporary=is_temporary(message.type)))

    def expire(self, now_s: float) -> None:
        """Ask again, or give up."""
        if self._tries < CLEAR_PATIENCE.tries:
            self.begin(now_s)
            return
        what = f"clearing the {self.mission_type.name.lower()}"
        self.fail(NoAnswerError(f"{what}: no answer, though asked {self._tries} times"))


class SetCurrentItem(CommandExchange[None]):
    """Have the stored mission go on at an item: by DO_SET_MISSION_CURRENT, or where that is not
    known by its predecessor, of which MISSION_CURRENT shows what it did."""

    wants = CommandExchange.wants | {_CURRENT.id}

    def __init__(
        self, target: Address, sequence: int, *, retry_policy: RetryPolicy = RETRIES
    ) -> None:
        command = dialect.MAV_CMD_DO_SET_MISSION_CURRENT
        super().__init__(target, command, (sequence,), retry_policy=retry_policy)
        self.name = f"current item {sequence}"
        self._sequence = sequence
        self._by_message = False
        self._tries = 0

    def accepted(self, ack: Message, now_s: float) -> None:
        """It is done."""
        self.succeed(None)

    def refused(self, result: int, now_s: float) -> None:
        """An autopilot that does not know the command knows the message."""
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
        """Ask again, or give up."""
        if not self._by_message:
            super().expire(now_s)
        elif self._tries < self.retry_policy.tries:
            self._send(now_s)
        else:
            shown = "it does not show it, though asked"
            self.fail(NoAnswerError(f"{self.name}: {shown} {self._tries} times"))

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
    """One stored item outside of a download, which ArduPilot allows (its item 0 is home) and PX4
    does not.

    Fails with `RefusedError` (a MAV_MISSION_RESULT) or `NoAnswerError`.
    """

    wants = frozenset({ITEM_INT.id, ITEM_FLOAT.id, _ACK.id})

    def __init__(
        self,
        target: Address,
        sequence: int,
        mission_type: MissionType = MissionType.MISSION,
        *,
        retry_policy: RetryPolicy = RETRIES,
    ) -> None:
        super().__init__(("mission", target))
        self.target, self.mission_type, self.retry_policy = target, mission_type, retry_policy
        self._sequence = sequence
        self._tries = 0

    def begin(self, now_s: float) -> None:
        """Ask."""
        self._tries += 1
        self.outbox.append(item_request(self.target, self._sequence, self.mission_type))
        self.deadline_s = now_s + self.retry_policy.answer_s

    def receive(self, message: Message, sender: Address, now_s: float) -> None:
        """The item, or a refusal."""
        is_ours = sender == self.target and message.mission_type == self.mission_type
        if not is_ours or not self.for_us(message):
            return
        if message.TYPE is not _ACK:
            if message.seq == self._sequence:
                self.succeed(item_of(message))
        elif message.type not in (ACCEPTED, CANCELLED):  # those are of earlier exchanges
            reason = f"item {self._sequence}: {mission_result_words(message.type)}"
            self.fail(RefusedError(reason, message.type, temporary=is_temporary(message.type)))

    def expire(self, now_s: float) -> None:
        """Ask again, or give up."""
        if self._tries < self.retry_policy.tries:
            self.begin(now_s)
        else:
            asked = f"no answer, though asked {self._tries} times"
            self.fail(NoAnswerError(f"item {self._sequence}: {asked}"))
