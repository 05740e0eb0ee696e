"""Intervals of messages, and single messages on request (mavlink.io, "Command Protocol" and
"Requesting Messages", mavgen_c/howto_requestmessages.html)."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.microservices.commands import CommandExchange, Request, message_name
from m2pem_plugin_mavlink.microservices.parameters import ParameterEncoding
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import RETRIES, RetryPolicy

T = TypeVar("T")

US_PER_S = 1_000_000
SLOWER = 2.0
SLOWER_TRIES = 4
"""Attempts after a refused rate, each slower by the factor `SLOWER`: autopilots deny rates that are
faster than their main loop allows."""

_INTERVAL = message_type("MESSAGE_INTERVAL").id


class SetMessageInterval(CommandExchange[float]):
    """Sets the interval of a message in seconds of the vehicle's clock. The result is the accepted
    interval, which is longer if the requested one was denied. An unknown message is denied at any
    interval.

    `interval_s`: 0 for what the vehicle sends by itself, -1 for never.
    """

    def __init__(
        self,
        target: Address,
        message_id: int,
        interval_s: float,
        *,
        retry_policy: RetryPolicy = RETRIES,
    ) -> None:
        self._message_id, self._interval_s = message_id, interval_s
        self._slower_left = SLOWER_TRIES if interval_s > 0 else 0
        super().__init__(
            target, dialect.MAV_CMD_SET_MESSAGE_INTERVAL, self._values(), retry_policy=retry_policy
        )
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


class ReadMessageInterval(Request[float]):
    """Reads the seconds between two messages of one kind; -1: not sent, 0: the vehicle has no such
    message. (GET_MESSAGE_INTERVAL, which more autopilots know than its successor.)"""

    def __init__(
        self, target: Address, message_id: int, *, retry_policy: RetryPolicy = RETRIES
    ) -> None:
        def read(message: Message) -> float | None:
            if message.message_id != message_id:
                return None
            interval_us = int(message.interval_us)
            return interval_us / US_PER_S if interval_us > 0 else float(interval_us)

        command = dialect.MAV_CMD_GET_MESSAGE_INTERVAL
        super().__init__(target, command, (message_id,), _INTERVAL, read, retry_policy=retry_policy)


class RequestMessage(Request[T]):
    """Requests one message once; the result is that of `read`.

    Args:
        name: of the message: "HOME_POSITION".
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
        super().__init__(target, command, (id_, index), id_, read, retry_policy=retry_policy)
        self.name = f"request for {name}"


def as_it_is(message: Message) -> Message:
    """Return the message itself; for `RequestMessage`."""
    return message


_STAGES: dict[int, str] = {
    dialect.FIRMWARE_VERSION_TYPE_DEV: "-dev",
    dialect.FIRMWARE_VERSION_TYPE_ALPHA: "-alpha",
    dialect.FIRMWARE_VERSION_TYPE_BETA: "-beta",
    dialect.FIRMWARE_VERSION_TYPE_RC: "-rc",
    dialect.FIRMWARE_VERSION_TYPE_OFFICIAL: "",
}


@dataclass(frozen=True, slots=True)
class AutopilotVersion:
    """`version`: major, minor, patch; `stage`: "" for a release, "-dev", "-beta" and so on;
    `capabilities`: MAV_PROTOCOL_CAPABILITY; `uid`: of the hardware, 0 where it has none."""

    version: tuple[int, int, int]
    stage: str
    capabilities: int
    uid: int

    def __str__(self) -> str:
        return ".".join(str(each) for each in self.version) + self.stage

    def has(self, capability: int) -> bool:
        """Return whether the autopilot has a MAV_PROTOCOL_CAPABILITY."""
        return bool(self.capabilities & capability)

    @property
    def parameter_encoding(self) -> ParameterEncoding | None:
        """The encoding of whole numbers in parameters; None: not reported."""
        if self.has(dialect.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE):
            return ParameterEncoding.BYTEWISE
        if self.has(dialect.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST):
            return ParameterEncoding.C_CAST
        return None


class ReadAutopilotVersion(RequestMessage[AutopilotVersion]):
    """Reads the version and the capabilities of an autopilot's firmware."""

    def __init__(self, target: Address) -> None:
        super().__init__(target, "AUTOPILOT_VERSION", version_of)


def version_of(message: Message) -> AutopilotVersion:
    """Return the content of an AUTOPILOT_VERSION."""
    major, minor, patch, stage = message.flight_sw_version.to_bytes(4, "big")
    words = _STAGES.get(stage, f"-{stage}")
    return AutopilotVersion((major, minor, patch), words, message.capabilities, message.uid)
