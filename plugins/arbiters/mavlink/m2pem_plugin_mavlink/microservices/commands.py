"""Commands and their acknowledgements (mavlink.io, "Command Protocol", services/command.html)."""

import math
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.microservices.texts import StatusTexts, Text
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import (
    RETRIES,
    ExchangeError,
    NoAnswerError,
    RefusedError,
    RetryPolicy,
    Transaction,
)

_WORDS: dict[int, str] = {
    dialect.MAV_RESULT_TEMPORARILY_REJECTED: "not possible now",
    dialect.MAV_RESULT_DENIED: "denied, in this state or with these values",
    dialect.MAV_RESULT_UNSUPPORTED: "not supported",
    dialect.MAV_RESULT_FAILED: "failed",
    6: "cancelled",  # MAV_RESULT_CANCELLED, which the dialect does not have
    dialect.MAV_RESULT_COMMAND_LONG_ONLY: "accepted only as COMMAND_LONG",
    dialect.MAV_RESULT_COMMAND_INT_ONLY: "accepted only as COMMAND_INT",
}
MOST_TEXTS = 3


def result_words(result: int) -> str:
    """Return a text for a MAV_RESULT other than "accepted"."""
    return _WORDS.get(result, f"refused with result {result}")


def command_name(command: int) -> str:
    """Return the name of a MAV_CMD: "COMPONENT_ARM_DISARM"."""
    known = dialect.enums["MAV_CMD"].get(command)
    return str(known.name).removeprefix("MAV_CMD_") if known else f"command {command}"


def message_name(id_: int) -> str:
    """Return the name of a message: "GLOBAL_POSITION_INT"."""
    known = dialect.mavlink_map.get(id_)
    return str(known.msgname) if known else f"message {id_}"


def with_reason(what: str, texts: Sequence[Text]) -> str:
    """Return a refusal with the texts of the vehicle: "ARM: failed (PreArm: no position)"."""
    said = dict.fromkeys(each.text for each in texts if each.text)
    reasons = "; ".join(list(said)[-MOST_TEXTS:])
    return f"{what} ({reasons})" if reasons else what


T = TypeVar("T")

PROGRESS_S = 10.0
"""A command in progress without a message for this long has failed."""

LONGEST_S = 120.0
"""Longest time in seconds for which a command may be in progress."""

REASON_S = 0.5
"""A refusal is followed by a text that says why, and some autopilots send it a little later."""

WORSE_THAN: int = dialect.MAV_SEVERITY_INFO
"""Only texts that are worse than this severity count as the reason of a refusal."""

DEG_TO_1E7 = 1e7

_LONG = message_type("COMMAND_LONG")
_INT = message_type("COMMAND_INT")
_ACK = message_type("COMMAND_ACK").id
_TEXT = message_type("STATUSTEXT").id
_OTHER_FORM = (dialect.MAV_RESULT_COMMAND_LONG_ONLY, dialect.MAV_RESULT_COMMAND_INT_ONLY)
_CLEAR = (dialect.MAV_RESULT_UNSUPPORTED, *_OTHER_FORM)
"""Results that need no further text of the vehicle."""


@dataclass(frozen=True, slots=True)
class CommandPosition:
    """Param 5 to 7 of a command that has a place: WGS-84 degrees, and an altitude in a MAV_FRAME;
    an altitude that is NaN stays as it is."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float
    frame: int = dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT


class CommandExchange(Transaction[T]):
    """Sends a command until it is acknowledged; subclasses process the acknowledgement.

    Args:
        target: the component that executes the command.
        command: a MAV_CMD.
        params: its param1 and so on, as many as matter; the others are 0.
        place: its param5 to param7, which are then sent as whole numbers (COMMAND_INT).

    Fails with `RefusedError` (a MAV_RESULT; with the texts that the vehicle sent meanwhile) or
    `NoAnswerError`, at the latest after `LONGEST_S`, and without progress after `retry_policy`.
    """

    wants = frozenset({_ACK, _TEXT})

    def __init__(
        self,
        target: Address,
        command: int,
        params: Sequence[float] = (),
        *,
        place: CommandPosition | None = None,
        retry_policy: RetryPolicy = RETRIES,
    ) -> None:
        super().__init__(("command", target, command))
        self.target, self.command = target, command
        self.name = command_name(command)
        self.retry_policy = retry_policy
        self._params = tuple(float(each) for each in params) + (0.0,) * (7 - len(params))
        self._place = place
        self._as_int = place is not None
        self._form_changed = False
        self._texts = StatusTexts()
        self._sent_count = 0
        self._began_s = 0.0
        self._in_progress = False
        self._refused: RefusedError | None = None

    def begin(self, now_s: float) -> None:
        """Send the command, if it is valid."""
        self._began_s = now_s
        problem = self._problem()
        if problem:
            self.fail(ExchangeError(f"{self.name}: {problem}"))
        else:
            self._ask(now_s)

    def receive(self, message: Message, sender: Address, now_s: float) -> None:
        """Receive an acknowledgement or a text; others are ignored."""
        if message.TYPE.id == _TEXT:
            self._texts.take(message, sender, now_s)
        elif message.TYPE.id == _ACK and not self.done and self._refused is None:
            is_expected = (message.command, sender) == (self.command, self.target)
            if is_expected and self.for_us(message):
                self._acknowledged(message, now_s)

    def expire(self, now_s: float) -> None:
        """Repeat the request, or fail."""
        if self._refused is not None:
            self._texts.give_up(now_s)
            texts = self._texts.recent(now_s, worse_than=WORSE_THAN)
            refused = self._refused
            reason = with_reason(refused.reason, texts)
            self.fail(RefusedError(reason, refused.result, temporary=refused.temporary))
        elif self._in_progress:  # a repetition might start it again
            self.fail(NoAnswerError(f"{self.name}: in progress, but no more messages about it"))
        elif self._sent_count < self.retry_policy.tries:
            self._ask(now_s)
        else:
            self.fail(NoAnswerError(self._silence()))

    @abstractmethod
    def accepted(self, ack: Message, now_s: float) -> None:
        """Process the acceptance of the command."""

    def refused(self, result: int, now_s: float) -> None:
        """Process a refusal: fail when the reason was received, unless a subclass does something
        else."""
        temporary = result == dialect.MAV_RESULT_TEMPORARILY_REJECTED
        words = f"{self.name}: {result_words(result)}"
        self._refused = RefusedError(words, result, temporary=temporary)
        self.deadline_s = now_s + REASON_S
        if result in _CLEAR:
            self.fail(self._refused)

    def ask_anew(self, params: Sequence[float], now_s: float) -> None:
        """Send the command with other parameters, as a new one."""
        self._params = tuple(float(each) for each in params) + (0.0,) * (7 - len(params))
        self._sent_count = 0
        self._ask(now_s)

    def _acknowledged(self, ack: Message, now_s: float) -> None:
        result = ack.result
        if result == dialect.MAV_RESULT_ACCEPTED:
            self.accepted(ack, now_s)
        elif result == dialect.MAV_RESULT_IN_PROGRESS:
            self._in_progress = True
            self.deadline_s = min(now_s + PROGRESS_S, self._began_s + LONGEST_S)
        elif result in _OTHER_FORM and not self._form_changed and self._has_other_form(result):
            self._form_changed = True
            self._as_int = not self._as_int
            self._sent_count = 0
            self._ask(now_s)
        else:
            self.refused(result, now_s)

    def _has_other_form(self, result: int) -> bool:
        """Return whether the command has another form: COMMAND_INT cannot have NaN."""
        if self._as_int:
            return bool(result == dialect.MAV_RESULT_COMMAND_LONG_ONLY)
        whole = all(math.isfinite(each) for each in self._params[4:6])
        return whole and bool(result == dialect.MAV_RESULT_COMMAND_INT_ONLY)

    def _ask(self, now_s: float) -> None:
        self.outbox.append(self._message(self._sent_count))
        self._sent_count += 1
        self.deadline_s = now_s + self.retry_policy.answer_s

    def _message(self, confirmation: int) -> Message:
        places = self._params[4:]
        if self._place is not None:
            place = self._place
            places = (place.latitude_deg, place.longitude_deg, place.altitude_m)
        named = {f"param{number}": each for number, each in enumerate(self._params[:4], 1)}
        named |= {**self.target.as_target, "command": self.command}
        if self._as_int:
            scale = DEG_TO_1E7 if self._place is not None else 1.0
            return _INT.make(
                **named,
                frame=self._place.frame if self._place is not None else dialect.MAV_FRAME_MISSION,
                x=round(places[0] * scale),
                y=round(places[1] * scale),
                z=places[2],
            )
        named |= {f"param{number}": each for number, each in enumerate(places, 5)}
        return _LONG.make(**named, confirmation=min(confirmation, 255))

    def _problem(self) -> str:
        """Return why the command cannot be sent; "" if it can."""
        if len(self._params) > 7:
            return f"has seven parameters, not {len(self._params)}"
        if any(math.isinf(each) for each in self._params):
            return "a parameter is infinite"
        place = self._place
        if place is None:
            return ""
        if not (abs(place.latitude_deg) <= 90.0 and abs(place.longitude_deg) <= 180.0):
            return f"{place.latitude_deg}, {place.longitude_deg} is not a position"
        return "the altitude is infinite" if math.isinf(place.altitude_m) else ""

    def _silence(self) -> str:
        often = "once" if self._sent_count == 1 else f"{self._sent_count} times"
        return f"{self.name}: no answer; sent {often} in {self.retry_policy.bound_s:g} s"


class Command(CommandExchange[Message]):
    """A command; its result is the COMMAND_ACK that accepted it."""

    def accepted(self, ack: Message, now_s: float) -> None:
        """End: the command is executed, or its execution has begun."""
        self.succeed(ack)
