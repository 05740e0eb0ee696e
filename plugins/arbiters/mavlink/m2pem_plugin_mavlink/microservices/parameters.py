"""Reading a parameter by its name (mavlink.io, "Parameter Protocol", services/parameter.html)."""

import math
import struct
from enum import Enum

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import (
    RETRIES,
    ExchangeError,
    NoAnswerError,
    RefusedError,
    Transaction,
)

NAME_BYTES = 16

_WHOLE: dict[int, str] = {  # how it is laid out in four bytes
    dialect.MAV_PARAM_TYPE_UINT8: "<B3x",
    dialect.MAV_PARAM_TYPE_INT8: "<b3x",
    dialect.MAV_PARAM_TYPE_UINT16: "<H2x",
    dialect.MAV_PARAM_TYPE_INT16: "<h2x",
    dialect.MAV_PARAM_TYPE_UINT32: "<I",
    dialect.MAV_PARAM_TYPE_INT32: "<i",
}


class ParameterEncoding(Enum):
    """The encoding of whole numbers."""

    C_CAST = "c_cast"
    BYTEWISE = "bytewise"


def encoded_name(name: str) -> bytes:
    """Return a name as the bytes of a message.

    Raises:
        ValueError: the name is not valid.
    """
    encoded = name.encode("ascii", "replace")
    if not name or len(encoded) > NAME_BYTES or not name.isascii() or not name.isprintable():
        raise ValueError(f"'{name}' is not a parameter name: 1 to {NAME_BYTES} ASCII characters")
    return encoded


def value_of(message: Message, encoding: ParameterEncoding) -> float:
    """Return the value in a PARAM_VALUE, an int where its MAV_PARAM_TYPE is a whole number."""
    value: float = message.param_value
    layout = _WHOLE.get(message.param_type)
    if layout is not None and encoding is ParameterEncoding.BYTEWISE:
        value = struct.unpack(layout, struct.pack("<f", value))[0]
    elif layout is not None and math.isfinite(value):
        value = round(value)
    return value


_BY_NAME = -1
"""The index in requests that name a parameter."""

_READ = message_type("PARAM_REQUEST_READ")
_VALUE = message_type("PARAM_VALUE")
PARAM_VALUE = _VALUE.id
_ERROR = message_type("PARAM_ERROR")
_ERRORS: dict[int, str] = {
    dialect.MAV_PARAM_ERROR_DOES_NOT_EXIST: "it has no such parameter",
    dialect.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE: "the value is out of range",
    dialect.MAV_PARAM_ERROR_PERMISSION_DENIED: "m2pem may not set it",
    dialect.MAV_PARAM_ERROR_COMPONENT_NOT_FOUND: "there is no such component",
    dialect.MAV_PARAM_ERROR_READ_ONLY: "it cannot be set",
}


class ReadParameter(Transaction[float]):
    """Reads the value of a parameter.

    For a parameter that it does not have, an autopilot sends no answer: `NoAnswerError`. Newer ones
    send a MAV_PARAM_ERROR: `RefusedError`.
    """

    wants = frozenset({_VALUE.id, _ERROR.id})

    def __init__(self, target: Address, name: str, encoding: ParameterEncoding) -> None:
        super().__init__(("parameter", target, name))
        self.target, self.name, self.encoding = target, name, encoding
        self._encoded = b""
        self._tries = 0

    def begin(self, now_s: float) -> None:
        """Send the request, if the name is valid."""
        try:
            self._encoded = encoded_name(self.name)
        except ValueError as error:
            self.fail(ExchangeError(str(error)))
            return
        self._ask(now_s)

    def receive(self, message: Message, sender: Address, now_s: float) -> None:
        """Receive a value or an error; other parameters and components are ignored."""
        is_expected = (message.param_id, sender) == (self._encoded, self.target)
        if self.done or not is_expected or not self.for_us(message):
            return
        if message.TYPE is _VALUE:
            self.succeed(value_of(message, self.encoding))
        elif message.error in _ERRORS:
            reason = f"parameter {self.name}: {_ERRORS[message.error]}"
            self.fail(RefusedError(reason, message.error))

    def expire(self, now_s: float) -> None:
        """Repeat the request, or fail."""
        if self._tries < RETRIES.tries:
            self._ask(now_s)
        else:
            silence = "no answer: perhaps it has no such parameter"
            self.fail(NoAnswerError(f"parameter {self.name}: {silence}"))

    def _ask(self, now_s: float) -> None:
        self._tries += 1
        target = self.target.as_target
        self.outbox.append(_READ.make(**target, param_index=_BY_NAME, param_id=self._encoded))
        self.deadline_s = now_s + RETRIES.answer_s
