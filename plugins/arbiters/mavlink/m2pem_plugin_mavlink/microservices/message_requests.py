"""Intervals of messages, and single messages on request (mavlink.io, "Command Protocol" and
"Requesting Messages", mavgen_c/howto_requestmessages.html)."""

from collections.abc import Callable
from typing import TypeVar

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import US_PER_S
from m2pem_plugin_mavlink.microservices.commands import CommandExchange, message_name
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import RETRIES, RetryPolicy

T = TypeVar("T")

SLOWER = 2.0
SLOWER_TRIES = 4
"""Attempts after a refused rate, each slower by the factor `SLOWER`: autopilots deny rates that are
faster than their main loop allows."""


class SetMessageInterval(CommandExchange[float]):
    """Sets the interval of a message in seconds of the vehicle's clock. The result is the accepted
    interval, which is longer if the requested one was denied. An unknown message is denied at any
    interval.

    `interval_s`: 0 for what the vehicle sends by itself, -1 for never.
    """

    def __init__(self, target: Address, message_id: int, interval_s: float) -> None:
        self._message_id, self._interval_s = message_id, interval_s
        self._slower_left = SLOWER_TRIES if interval_s > 0 else 0
        super().__init__(target, dialect.MAV_CMD_SET_MESSAGE_INTERVAL, self._values())
        self.name = f"{self.name} of {message_name(message_id)}"

    def accepted(self, ack: Message, now_s: float) -> None:
        """End with the accepted interval."""
        self.succeed(self._interval_s)

    def refused(self, result: int, now_s: float) -> None:
        """Try a slower rate if that may be accepted."""
        if result == dialect.MAV_RESULT_DENIED and self._slower_left:
            self._slower_left -= 1
            self._interval_s *= SLOWER
            self.ask_anew(self._values(), now_s)
        else:
            super().refused(result, now_s)

    def _values(self) -> tuple[float, float]:
        interval_us = self._interval_s * US_PER_S if self._interval_s > 0 else self._interval_s
        return float(self._message_id), interval_us


class RequestMessage(CommandExchange[T]):
    """Requests one message once. The message counts even if the acknowledgement is lost.

    Args:
        name: of the message: "HOME_POSITION".
        read: returns the result in the message; None: it is not the requested one.
        index: of the camera or image, if there are several.
    """

    def __init__(
        self,
        target: Address,
        name: str,
        read: Callable[[Message], T | None],
        *,
        index: int = 0,
        retry_policy: RetryPolicy = RETRIES,
    ) -> None:
        id_ = message_type(name).id
        command = dialect.MAV_CMD_REQUEST_MESSAGE
        super().__init__(target, command, (id_, index), retry_policy=retry_policy)
        self.name = f"request for {name}"
        self.wants = CommandExchange.wants | {id_}
        self._answer, self._read = id_, read
        self._accepted = False

    def receive(self, message: Message, sender: Address, now_s: float) -> None:
        """Receive the message or an acknowledgement."""
        if message.TYPE.id == self._answer and sender == self.target:
            result = self._read(message) if self.for_us(message) else None
            if result is not None:
                self.succeed(result)
        else:
            super().receive(message, sender, now_s)

    def accepted(self, ack: Message, now_s: float) -> None:
        """Wait for the message; `expire` requests it again."""
        self._accepted = True

    def _silence(self) -> str:
        if not self._accepted:
            return super()._silence()
        return f"{self.name}: accepted, but no answer was received"
