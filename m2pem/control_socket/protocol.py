"""JSON-RPC 2.0, one message a line. See https://www.jsonrpc.org/specification."""

from enum import IntEnum
from typing import Any

import msgspec

from m2pem.control_socket.paths import ControlSocketError
from m2pem.errors import (
    BusyError,
    M2pemError,
    MissionError,
    NotApprovedError,
    NotDrivenError,
    OperatorError,
    StuckError,
)
from m2pem.findings import Finding

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
    FINDINGS = -32002
    """A `MissionError`; `data` has its findings."""
    BUSY = -32003
    """A `BusyError`; `data` has who has what."""
    STUCK = -32004
    """A `StuckError`: the choice must be confirmed."""
    NOT_APPROVED = -32005
    """A `NotApprovedError`; `data` has how many persons more must approve the mission."""


class FaultData(msgspec.Struct, frozen=True, omit_defaults=True):
    """The `data` of an error. `holders`: the run or the operator that has each resource.
    `missing`: how many persons more must approve a mission."""

    what: str = ""
    findings: list[Finding] = msgspec.field(default_factory=list)
    holders: dict[str, str] = msgspec.field(default_factory=dict)
    missing: int = 0


class Fault(msgspec.Struct, frozen=True, omit_defaults=True):
    """The `error` of a response."""

    code: int
    message: str
    data: FaultData = FaultData()


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


def fault_of(error: M2pemError) -> Fault:
    """What a caller gets when the executive refuses."""
    match error:
        case MissionError():
            data = FaultData(what=error.what, findings=list(error.findings))
            return Fault(Code.FINDINGS, str(error), data)
        case BusyError():
            return Fault(Code.BUSY, str(error), FaultData(holders=error.holders))
        case NotDrivenError():
            return Fault(Code.NOT_DRIVEN, str(error))
        case StuckError():
            return Fault(Code.STUCK, str(error))
        case NotApprovedError():
            return Fault(Code.NOT_APPROVED, str(error), FaultData(missing=error.missing))
    return Fault(Code.REFUSED, str(error))


def error_of(fault: Fault) -> M2pemError:
    """The error that `fault_of` had."""
    match fault.code:
        case Code.FINDINGS:
            return MissionError(fault.data.what, fault.data.findings)
        case Code.BUSY:
            return BusyError(fault.message, fault.data.holders)
        case Code.NOT_DRIVEN:
            return NotDrivenError(fault.message)
        case Code.STUCK:
            return StuckError(fault.message)
        case Code.NOT_APPROVED:
            return NotApprovedError(fault.message, fault.data.missing)
        case Code.REFUSED:
            return OperatorError(fault.message)
    return ControlSocketError(fault.message)


def result_of(answer: bytes) -> Any:
    """The result that a line brings.

    Raises:
        MissionError: the mission is not well or does not fit the fleet.
        OperatorError: the executive refused.
        ControlSocketError: it went away, or did not understand, or is not understood.
    """
    if not answer:
        raise ControlSocketError(
            "the executive has ended: it may have done what it was asked, or not"
        )
    try:
        response = msgspec.json.decode(answer, type=Response)
    except (msgspec.MsgspecError, UnicodeError, RecursionError) as error:
        raise ControlSocketError(f"the executive answered what is no JSON-RPC: {error}") from error
    if isinstance(response.error, Fault):
        raise error_of(response.error)
    return None if response.result is msgspec.UNSET else response.result
