"""An exchange with one vehicle, as a state machine without I/O: messages and time in, messages out.

`link.perform` runs it: it calls `begin` once, `receive` for each message that the exchange wants
from its vehicle, and `expire` when `deadline_s` has passed; after each of them it sends the
messages of `outbox`. All times are seconds of one clock that never goes back.
"""

from abc import ABC, abstractmethod
from collections.abc import Hashable
from dataclasses import dataclass
from typing import Generic, TypeVar

from m2pem_plugin_mavlink.protocol.messages import Address, Message

T = TypeVar("T")


class ExchangeError(Exception):
    """The vehicle did not do what was requested. `reason` is for people."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


class NoAnswerError(ExchangeError):
    """The vehicle did not answer any request; it may have received one."""


class RefusedError(ExchangeError):
    """The vehicle refused. `result`: MAV_RESULT or MAV_MISSION_RESULT, by the exchange;
    `temporary`: a later request may succeed."""

    def __init__(self, reason: str, result: int, *, temporary: bool = False) -> None:
        super().__init__(reason)
        self.result = result
        self.temporary = temporary


class Transaction(ABC, Generic[T]):
    """One exchange. It ends by `succeed` or `fail`, once; what comes after that changes nothing.

    `wants`: ids of the messages that it receives. `key`: of two exchanges with the same key
    with one vehicle, the second waits for the first to end. `source`: the address of this
    ground station, set by the link before `begin`; None: all answers are for it.
    """

    wants: frozenset[int]

    def __init__(self, key: Hashable) -> None:
        self.key = key
        self.source: Address | None = None
        self.outbox: list[Message] = []
        self.deadline_s: float | None = None
        self.done = False
        self._result: T | None = None
        self._error: ExchangeError | None = None

    @abstractmethod
    def begin(self, now_s: float) -> None:
        """Send the first request."""

    @abstractmethod
    def receive(self, message: Message, sender: Address, now_s: float) -> None:
        """Receive a message of `wants`; it may be another client's answer, late or doubled."""

    @abstractmethod
    def expire(self, now_s: float) -> None:
        """`deadline_s` has passed: repeat the request, or `fail`."""

    def for_us(self, message: Message) -> bool:
        """Return whether the message is addressed to this ground station or to all (mavlink.io,
        "Routing")."""
        if self.source is None:
            return True
        system = getattr(message, "target_system", 0)
        component = getattr(message, "target_component", 0)
        return system in (0, self.source.system) and component in (0, self.source.component)

    def succeed(self, result: T) -> None:
        """End with a result."""
        if not self.done:
            self.done, self._result, self.deadline_s = True, result, None

    def fail(self, error: ExchangeError) -> None:
        """End with an error."""
        if not self.done:
            self.done, self._error, self.deadline_s = True, error, None

    def outcome(self) -> T:
        """Return the result of a transaction that is done.

        Raises:
            ExchangeError: it failed.
        """
        if self._error is not None:
            raise self._error
        return self._result  # type: ignore[return-value]  # `succeed` has set it


@dataclass(frozen=True, slots=True)
class RetryPolicy:
    """The number of requests (`tries`), and the seconds to wait for each answer (`answer_s`)."""

    tries: int
    answer_s: float

    @property
    def bound_s(self) -> float:
        """The time after which a silent vehicle makes the exchange fail."""
        return self.tries * self.answer_s


RETRIES = RetryPolicy(tries=5, answer_s=1.0)
"""For questions with one answer. mavlink.io, "Command Protocol", leaves times to the sender; ground
stations wait 0.5 to 1.5 s, three to five times. Links by satellite or mesh answer after 4 s."""
