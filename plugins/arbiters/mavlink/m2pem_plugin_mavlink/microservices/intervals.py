"""How often messages are sent, and single ones on request (mavlink.io, "Command Protocol" and
"Requesting Messages", mavgen_c/howto_requestmessages.html)."""

from collections.abc import Callable
from typing import TypeVar

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.microservices.commands import CommandExchange, Request
from m2pem_plugin_mavlink.microservices.patience import PATIENCE, Patience
from m2pem_plugin_mavlink.microservices.refusals import message_name
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type

T = TypeVar("T")

US_PER_S = 1_000_000
SLOWER = 2.0
SLOWER_TRIES = 4
"""A rate that is refused is tried slower by `SLOWER` so often: autopilots deny what is faster than
their main loop allows."""

_INTERVAL = message_type("MESSAGE_INTERVAL").id


class SetMessageInterval(CommandExchange[float]):
    """Have a message sent every so many seconds, by the vehicle's clock; the result is the interval
    that was accepted, which is longer where the one asked for was denied. An unknown message is
    denied just as well, at last.

    `interval_s`: 0 for what the vehicle sends by itself, -1 for never.
    """

    def __init__(
        self,
        target: Address,
        message_id: int,
        interval_s: float,
        *,
        patience: Patience = PATIENCE,
    ) -> None:
        self._message_id, self._interval_s = message_id, interval_s
        self._slower_left = SLOWER_TRIES if interval_s > 0 else 0
        super().__init__(
            target, dialect.MAV_CMD_SET_MESSAGE_INTERVAL, self._values(), patience=patience
        )
        self.name = f"{self.name} of {message_name(message_id)}"

    def accepted(self, ack: Message, now_s: float) -> None:
        """This often, then."""
        self.succeed(self._interval_s)

    def refused(self, result: int, now_s: float) -> None:
        """Slower, if that may help."""
        if result == dialect.MAV_RESULT_DENIED and self._slower_left:
            self._slower_left -= 1
            self._interval_s *= SLOWER
            self.ask_anew(self._values(), now_s)
        else:
            super().refused(result, now_s)

    def _values(self) -> tuple[float, float]:
        interval_us = self._interval_s * US_PER_S if self._interval_s > 0 else self._interval_s
        return float(self._message_id), interval_us


class ReadMessageInterval(Request[float]):
    """The seconds between two messages of one kind; -1 where they are not sent, 0 where the vehicle
    has no such message. (GET_MESSAGE_INTERVAL, which more autopilots know than its successor.)"""

    def __init__(self, target: Address, message_id: int, *, patience: Patience = PATIENCE) -> None:
        def read(message: Message) -> float | None:
            if message.message_id != message_id:
                return None
            interval_us = int(message.interval_us)
            return interval_us / US_PER_S if interval_us > 0 else float(interval_us)

        command = dialect.MAV_CMD_GET_MESSAGE_INTERVAL
        super().__init__(target, command, (message_id,), _INTERVAL, read, patience=patience)


class RequestMessage(Request[T]):
    """One message once, as `read` makes it out.

    Args:
        name: of the message: "HOME_POSITION".
        index: where there is one for each of several things (cameras, images), which.
    """

    def __init__(
        self,
        target: Address,
        name: str,
        read: Callable[[Message], T | None],
        *,
        index: int = 0,
        patience: Patience = PATIENCE,
    ) -> None:
        id_ = message_type(name).id
        command = dialect.MAV_CMD_REQUEST_MESSAGE
        super().__init__(target, command, (id_, index), id_, read, patience=patience)
        self.name = f"request for {name}"


def as_it_is(message: Message) -> Message:
    """For `RequestMessage`: the message itself."""
    return message
