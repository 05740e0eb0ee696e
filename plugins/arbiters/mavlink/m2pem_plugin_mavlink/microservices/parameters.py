"""Reading and setting single parameters (mavlink.io, "Parameter Protocol",
services/parameter.html)."""

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.microservices.parameter_values import (
    Parameter,
    ParameterEncoding,
    carried,
    encoded_name,
    parameter_of,
    same_value,
)
from m2pem_plugin_mavlink.microservices.patience import PATIENCE, Patience
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.protocol.transaction import (
    ExchangeError,
    NoAnswerError,
    RefusedError,
    Transaction,
)

BY_NAME = -1
"""The index in requests that name a parameter."""

_READ = message_type("PARAM_REQUEST_READ")
_SET = message_type("PARAM_SET")
_VALUE = message_type("PARAM_VALUE")
_ERROR = message_type("PARAM_ERROR")
_ERRORS: dict[int, str] = {
    dialect.MAV_PARAM_ERROR_DOES_NOT_EXIST: "it has no such parameter",
    dialect.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE: "the value is out of range",
    dialect.MAV_PARAM_ERROR_PERMISSION_DENIED: "we may not set it",
    dialect.MAV_PARAM_ERROR_COMPONENT_NOT_FOUND: "there is no such component",
    dialect.MAV_PARAM_ERROR_READ_ONLY: "it cannot be set",
}


class ReadParameter(Transaction[Parameter]):
    """The value of a parameter.

    An autopilot says nothing of a parameter that it does not have: `NoAnswerError`. Newer ones do:
    `RefusedError` with a MAV_PARAM_ERROR.
    """

    wants = frozenset({_VALUE.id, _ERROR.id})

    def __init__(
        self,
        target: Address,
        name: str,
        encoding: ParameterEncoding = ParameterEncoding.C_CAST,
        *,
        patience: Patience = PATIENCE,
    ) -> None:
        super().__init__(("parameter", target, name))
        self.target, self.name, self.encoding, self.patience = target, name, encoding, patience
        self._encoded = b""
        self._tries = 0

    def begin(self, now_s: float) -> None:
        """Ask, if it can be asked for."""
        try:
            self._encoded = encoded_name(self.name)
        except ValueError as error:
            self.fail(ExchangeError(str(error)))
            return
        self._ask(now_s)

    def receive(self, message: Message, sender: Address, now_s: float) -> None:
        """A value or an error; other parameters, and those of other components, are not ours."""
        is_ours = (message.param_id, sender) == (self._encoded, self.target)
        if self.done or not is_ours or not self.for_us(message):
            return
        if message.TYPE is _VALUE:
            self.has(parameter_of(message, self.encoding), now_s)
        elif message.error in _ERRORS:
            reason = f"parameter {self.name}: {_ERRORS[message.error]}"
            self.fail(RefusedError(reason, message.error))

    def expire(self, now_s: float) -> None:
        """Ask again, or give up."""
        if self._tries < self.patience.tries:
            self._ask(now_s)
        else:
            silence = "no answer: perhaps it has no such parameter"
            self.fail(NoAnswerError(f"parameter {self.name}: {silence}"))

    def has(self, parameter: Parameter, now_s: float) -> None:
        """This is its value."""
        self.succeed(parameter)

    def _ask(self, now_s: float) -> None:
        self._tries += 1
        self.outbox.append(read_request(self.target, self._encoded, BY_NAME))
        self.deadline_s = now_s + self.patience.answer_s


class SetParameter(ReadParameter):
    """Give a parameter a value, and see that it has it; the result is what it has then. It is read
    first, as its type must be known; one that has the value already is not written again.

    Fails as `ReadParameter`, with `ExchangeError` if its type has no such value, and with
    `RefusedError` (result VALUE_OUT_OF_RANGE) if it keeps another one.
    """

    def __init__(
        self,
        target: Address,
        name: str,
        value: float,
        encoding: ParameterEncoding = ParameterEncoding.C_CAST,
        *,
        patience: Patience = PATIENCE,
    ) -> None:
        super().__init__(target, name, encoding, patience=patience)
        self.value = value
        self._kept: Parameter | None = None
        self._answered = False

    def has(self, parameter: Parameter, now_s: float) -> None:
        """Its value, before or after it was set."""
        if same_value(parameter, self.value):
            self.succeed(parameter)
        elif self._kept is None:
            self._kept = parameter
            self._tries = 0
            self._ask(now_s)
        else:  # perhaps a late answer to the reading; the deadline stays
            self._kept, self._answered = parameter, True

    def expire(self, now_s: float) -> None:
        """Set it again, or give up."""
        kept = self._kept
        if kept is None or self._tries < self.patience.tries:
            super().expire(now_s)
        elif self._answered:
            reason = f"parameter {self.name}: it keeps {kept.value:g} and does not take"
            result = dialect.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE
            self.fail(RefusedError(f"{reason} {self.value:g}", result))
        else:
            unknown = "set, but there is no answer; its value is not known"
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
        self.deadline_s = now_s + self.patience.answer_s


def read_request(target: Address, name: bytes, index: int) -> Message:
    """PARAM_REQUEST_READ, by name (`BY_NAME`) or index."""
    message: Message = _READ.make(
        param_index=index,
        target_system=target.system,
        target_component=target.component,
        param_id=name,
    )
    return message
