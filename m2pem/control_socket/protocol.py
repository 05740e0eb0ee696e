"""JSON-RPC 2.0, one message a line. See https://www.jsonrpc.org/specification."""

from enum import IntEnum
from typing import Any

import msgspec

from m2pem.control_socket.paths import ControlSocketError
from m2pem.errors import NotDrivenError, OperatorError

LONGEST_LINE_BYTES = 64 << 20
"""A mission with its images must fit."""


class Code(IntEnum):
    """Error codes: those of the specification, and from -32000 downwards our own."""

    PARSE_ERROR = -32700
    INVALID_REQUEST = -32600
    METHOD_NOT_FOUND = -32601
    INVALID_PARAMS = -32602
    INTERNAL_ERROR = -32603
    REFUSED = -32000
    """An `OperatorError`: the request cannot be met now."""
    NOT_DRIVEN = -32001
    """A `NotDrivenError`: perhaps another executive drives the run."""


class Fault(msgspec.Struct, frozen=True):
    """The `error` of a response."""

    code: int
    message: str


class Request(msgspec.Struct, frozen=True):
    """A call; without an `id` a notification, which is not answered."""

    jsonrpc: str
    method: str
    params: dict[str, Any] = msgspec.field(default_factory=dict)
    id: int | str | msgspec.UnsetType | None = msgspec.UNSET


class Response(msgspec.Struct, frozen=True):
    """The answer to a call: a result or an error."""

    jsonrpc: str = "2.0"
    id: int | str | None = None
    result: Any = msgspec.UNSET
    error: Fault | msgspec.UnsetType = msgspec.UNSET


def line(message: Request | Response) -> bytes:
    """A message as it is sent."""
    return msgspec.json.encode(message) + b"\n"


def result_of(answer: bytes) -> Any:
    """The result that a line brings.

    Raises:
        OperatorError: the executive refused.
        ControlSocketError: it went away, or did not understand, or is not understood.
    """
    if not answer:
        raise ControlSocketError("the executive closed the connection; has it just ended?")
    try:
        response = msgspec.json.decode(answer, type=Response)
    except (msgspec.MsgspecError, UnicodeError, RecursionError) as error:
        raise ControlSocketError(f"the executive answered what is no JSON-RPC: {error}") from error
    if isinstance(response.error, Fault):
        fault = response.error
        if fault.code == Code.NOT_DRIVEN:
            raise NotDrivenError(fault.message)
        if fault.code == Code.REFUSED:
            raise OperatorError(fault.message)
        raise ControlSocketError(fault.message)
    return None if response.result is msgspec.UNSET else response.result
