"""Parameters: their encoding, reading and setting single ones, and reading all of them (mavlink.io,
"Parameter Protocol", services/parameter.html).
"""

import math
import struct
from dataclasses import dataclass
from enum import Enum
from itertools import islice

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import (
    RETRIES,
    ExchangeError,
    NoAnswerError,
    RefusedError,
    RetryPolicy,
    Transaction,
)

NAME_BYTES = 16

_REAL32: int = dialect.MAV_PARAM_TYPE_REAL32
_WHOLE: dict[int, tuple[str, str]] = {  # how it is laid out in four bytes; its name
    dialect.MAV_PARAM_TYPE_UINT8: ("<B3x", "uint8"),
    dialect.MAV_PARAM_TYPE_INT8: ("<b3x", "int8"),
    dialect.MAV_PARAM_TYPE_UINT16: ("<H2x", "uint16"),
    dialect.MAV_PARAM_TYPE_INT16: ("<h2x", "int16"),
    dialect.MAV_PARAM_TYPE_UINT32: ("<I", "uint32"),
    dialect.MAV_PARAM_TYPE_INT32: ("<i", "int32"),
}
_FLOAT = struct.Struct("<f")


class ParameterEncoding(Enum):
    """The encoding of whole numbers."""

    C_CAST = "c_cast"
    BYTEWISE = "bytewise"


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter of a vehicle. `type`: a MAV_PARAM_TYPE; `value` is an int where that is
    a whole number; `index` of `count`: None and 0 where it was sent without being listed."""

    name: str
    value: float
    type: int
    index: int | None = None
    count: int = 0


def encoded_name(name: str) -> bytes:
    """Return a name as the bytes of a message.

    Raises:
        ValueError: the name is not valid.
    """
    encoded = name.encode("ascii", "replace")
    if not name or len(encoded) > NAME_BYTES or not name.isascii() or not name.isprintable():
        raise ValueError(f"'{name}' is not a parameter name: 1 to {NAME_BYTES} ASCII characters")
    return encoded


def parameter_of(message: Message, encoding: ParameterEncoding) -> Parameter:
    """Return the parameter in a PARAM_VALUE."""
    value: float = message.param_value
    whole = _WHOLE.get(message.param_type)
    if whole is not None and encoding is ParameterEncoding.BYTEWISE:
        value = struct.unpack(whole[0], _FLOAT.pack(value))[0]
    elif whole is not None and math.isfinite(value):
        value = round(value)
    listed = message.param_index < message.param_count
    return Parameter(
        name=message.param_id.decode("ascii", "replace"),
        value=value,
        type=message.param_type,
        index=message.param_index if listed else None,
        count=message.param_count if listed else 0,
    )


def carried(value: float, type_: int, encoding: ParameterEncoding) -> float:
    """Return the float that encodes a value of a MAV_PARAM_TYPE in PARAM_SET.

    Raises:
        ValueError: the type does not have the value, or it cannot be encoded.
    """
    if not math.isfinite(value):
        raise ValueError(f"{value} is not a finite number")
    if type_ not in _WHOLE:
        try:
            return float(_FLOAT.unpack(_FLOAT.pack(value))[0])
        except OverflowError:
            raise ValueError(f"{value:g} is too large for a float") from None
    layout, name = _WHOLE[type_]
    if value != int(value):
        raise ValueError(f"{value:g} is not a whole number, and the parameter is one ({name})")
    try:
        raw = struct.pack(layout, int(value))
    except struct.error:
        raise ValueError(f"{value:g} is outside of {name}") from None
    if encoding is ParameterEncoding.C_CAST:
        result = float(_FLOAT.unpack(_FLOAT.pack(value))[0])
        if result != value:
            raise ValueError(f"{value:.0f} has more digits than this autopilot can receive")
        return result
    result = float(_FLOAT.unpack(raw)[0])
    if _FLOAT.pack(result) != raw:  # the bytes of a NaN that Python does not keep
        raise ValueError(f"{value:.0f} cannot be sent")
    return result


def same_value(kept: Parameter, value: float) -> bool:
    """Return whether a parameter has a value, within the precision of floats of 32 bits."""
    if kept.type == _REAL32 or kept.type not in _WHOLE:
        return math.isclose(kept.value, value, rel_tol=1e-6, abs_tol=1e-9)
    return kept.value == value


BY_NAME = -1
"""The index in requests that name a parameter."""

_READ = message_type("PARAM_REQUEST_READ")
_SET = message_type("PARAM_SET")
_VALUE = message_type("PARAM_VALUE")
_ERROR = message_type("PARAM_ERROR")
_ERRORS: dict[int, str] = {
    dialect.MAV_PARAM_ERROR_DOES_NOT_EXIST: "it has no such parameter",
    dialect.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE: "the value is out of range",
    dialect.MAV_PARAM_ERROR_PERMISSION_DENIED: "m2pem may not set it",
    dialect.MAV_PARAM_ERROR_COMPONENT_NOT_FOUND: "there is no such component",
    dialect.MAV_PARAM_ERROR_READ_ONLY: "it cannot be set",
}


class ReadParameter(Transaction[Parameter]):
    """Reads the value of a parameter.

    For a parameter that it does not have, an autopilot sends no answer: `NoAnswerError`. Newer ones
    send a MAV_PARAM_ERROR: `RefusedError`.
    """

    wants = frozenset({_VALUE.id, _ERROR.id})

    def __init__(
        self,
        target: Address,
        name: str,
        encoding: ParameterEncoding = ParameterEncoding.C_CAST,
        *,
        retry_policy: RetryPolicy = RETRIES,
    ) -> None:
        super().__init__(("parameter", target, name))
        self.target, self.name, self.encoding, self.retry_policy = (
            target,
            name,
            encoding,
            retry_policy,
        )
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
            self.has(parameter_of(message, self.encoding), now_s)
        elif message.error in _ERRORS:
            reason = f"parameter {self.name}: {_ERRORS[message.error]}"
            self.fail(RefusedError(reason, message.error))

    def expire(self, now_s: float) -> None:
        """Repeat the request, or fail."""
        if self._tries < self.retry_policy.tries:
            self._ask(now_s)
        else:
            silence = "no answer: perhaps it has no such parameter"
            self.fail(NoAnswerError(f"parameter {self.name}: {silence}"))

    def has(self, parameter: Parameter, now_s: float) -> None:
        """Process the value."""
        self.succeed(parameter)

    def _ask(self, now_s: float) -> None:
        self._tries += 1
        self.outbox.append(read_request(self.target, self._encoded, BY_NAME))
        self.deadline_s = now_s + self.retry_policy.answer_s


class SetParameter(ReadParameter):
    """Sets a parameter, and checks its value; the result is the value afterwards. It is read first,
    as its type must be known; a parameter that has the value is not written again.

    Fails as `ReadParameter`, with `ExchangeError` if its type has no such value, and with
    `RefusedError` (result VALUE_OUT_OF_RANGE) if the vehicle keeps another value.
    """

    def __init__(
        self,
        target: Address,
        name: str,
        value: float,
        encoding: ParameterEncoding = ParameterEncoding.C_CAST,
        *,
        retry_policy: RetryPolicy = RETRIES,
    ) -> None:
        super().__init__(target, name, encoding, retry_policy=retry_policy)
        self.value = value
        self._kept: Parameter | None = None
        self._answered = False

    def has(self, parameter: Parameter, now_s: float) -> None:
        """Process the value, before or after it was set."""
        if same_value(parameter, self.value):
            self.succeed(parameter)
        elif self._kept is None:
            self._kept = parameter
            self._tries = 0
            self._ask(now_s)
        else:  # it may answer the earlier read request; the deadline stays
            self._kept, self._answered = parameter, True

    def expire(self, now_s: float) -> None:
        """Set the parameter again, or fail."""
        kept = self._kept
        if kept is None or self._tries < self.retry_policy.tries:
            super().expire(now_s)
        elif self._answered:
            reason = f"parameter {self.name}: it keeps {kept.value:g} and does not take"
            result = dialect.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE
            self.fail(RefusedError(f"{reason} {self.value:g}", result))
        else:
            unknown = "set, but not answered; its value is not known"
            self.fail(NoAnswerError(f"parameter {self.name}: {unknown}"))

    def _ask(self, now_s: float) -> None:
        if self._kept is None:
            super()._ask(now_s)
            return
        try:
            value = carried(self.value, self._kept.type, self.encoding)
        except ValueError as error:
            self.fail(ExchangeError(f"parameter {self.name}: {error}"))
            return
        self._tries += 1
        self.outbox.append(
            _SET.make(
                param_value=value,
                target_system=self.target.system,
                target_component=self.target.component,
                param_id=self._encoded,
                param_type=self._kept.type,
            )
        )
        self.deadline_s = now_s + self.retry_policy.answer_s


def read_request(target: Address, name: bytes, index: int) -> Message:
    """Return a PARAM_REQUEST_READ by name (`BY_NAME`) or by index."""
    message: Message = _READ.make(
        param_index=index,
        target_system=target.system,
        target_component=target.component,
        param_id=name,
    )
    return message


LIST_RETRIES = RetryPolicy(tries=5, answer_s=1.5)
"""Longest wait for the first and for the next parameter; then the missing ones are requested."""

GAP_RETRIES = RetryPolicy(tries=6, answer_s=1.0)
GAPS_AT_ONCE = 20
BASE_S = 60.0
PER_PARAMETER_S = 0.5
MOST = 10_000
"""Most parameters of a component; autopilots have about 1,500."""

_LIST = message_type("PARAM_REQUEST_LIST")


class ReadParameters(Transaction[dict[str, Parameter]]):
    """Reads all parameters of a component, by name.

    Fails with `NoAnswerError`, or `ExchangeError` for an impossible count; at the latest after
    `BASE_S` and `PER_PARAMETER_S` for each parameter.
    """

    wants = frozenset({_VALUE.id})

    def __init__(
        self, target: Address, encoding: ParameterEncoding = ParameterEncoding.C_CAST
    ) -> None:
        super().__init__(("parameters", target))
        self.target, self.encoding = target, encoding
        self._ends_s = self._began_s = 0.0
        self._tries = 0
        self._count = 0
        self._had: dict[int, Parameter] = {}
        self._requested: set[int] = set()

    def begin(self, now_s: float) -> None:
        """Request all parameters."""
        self._began_s = now_s
        self._ends_s = now_s + BASE_S
        self._ask(now_s)

    def receive(self, message: Message, sender: Address, now_s: float) -> None:
        """Process a parameter. One that is not of this list, but was read or set, has no index."""
        if self.done or sender != self.target:
            return
        parameter = parameter_of(message, self.encoding)
        if parameter.index is None:
            return
        if parameter.count > MOST:
            self._give_up(ExchangeError, f"{parameter.count} parameters are impossible")
            return
        if parameter.count != self._count:  # setting some parameters enables others
            self._count = parameter.count
            self._ends_s = self._began_s + BASE_S + PER_PARAMETER_S * self._count
            self._had = {n: each for n, each in self._had.items() if n < self._count}
        self._had[parameter.index] = parameter
        if len(self._had) == self._count:
            self.succeed({each.name: self._had[n] for n, each in sorted(self._had.items())})
        elif not self._requested:
            self.deadline_s = min(now_s + LIST_RETRIES.answer_s, self._ends_s)
        elif parameter.index in self._requested:
            self._requested.remove(parameter.index)
            self._tries = 0
            if not self._requested:
                self._ask_missing(now_s)

    def expire(self, now_s: float) -> None:
        """Request the missing parameters, or fail."""
        if now_s >= self._ends_s:
            self._give_up(NoAnswerError, "not done in time")
        elif not self._count and self._tries < LIST_RETRIES.tries:
            self._ask(now_s)
        elif not self._count:
            self._give_up(NoAnswerError, f"no answer after {self._tries} requests")
        elif not self._requested or self._tries < GAP_RETRIES.tries:
            if not self._requested:
                self._tries = 0
            self._ask_missing(now_s)
        else:
            self._give_up(NoAnswerError, "the others were not received")

    def _ask(self, now_s: float) -> None:
        self._tries += 1
        system, component = self.target
        self.outbox.append(_LIST.make(target_system=system, target_component=component))
        self.deadline_s = min(now_s + LIST_RETRIES.answer_s, self._ends_s)

    def _ask_missing(self, now_s: float) -> None:
        self._tries += 1
        missing = (index for index in range(self._count) if index not in self._had)
        self._requested = set(islice(missing, GAPS_AT_ONCE))
        for index in sorted(self._requested):
            self.outbox.append(read_request(self.target, b"", index))
        self.deadline_s = min(now_s + GAP_RETRIES.answer_s, self._ends_s)

    def _give_up(self, error: type[ExchangeError], reason: str) -> None:
        had = f" ({len(self._had)} of {self._count} received)" if self._count else ""
        self.fail(error(f"reading the parameters: {reason}{had}"))
