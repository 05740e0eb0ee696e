"""What the executive and a host say to each other, as msgpack.

A request has the same `id` when it is sent again; the host does it once. Times are microseconds of
the sender's clock, since the Unix epoch.
"""

import zlib
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import msgspec

from m2pem.api import (
    Area,
    BehaviorReport,
    BehaviorRequest,
    PayloadState,
    Point,
    ResolvedValue,
    ResourceId,
    Route,
    VehiclePosition,
    VehicleState,
)

VERSION = 2
"""Of these messages. Both ends must have the same."""


class MessageError(ValueError):
    """What arrived is no message of this version."""


class _Message(msgspec.Struct, frozen=True, array_like=True):
    """Without the names of its fields on the link."""


# --- what the executive asks --------------------------------------------------------------------


class Hello(_Message, frozen=True, tag=True):
    """The executive wants contact. `fresh`: its first one since it began. `going`: the behaviors
    that go on as it knows; the host holds what does something else. `who`: for people."""

    version: int
    who: str
    fresh: bool
    going: tuple[str, ...] = ()


class Ping(_Message, frozen=True, tag=True):
    """It is still there. `round_trip_s`: as it measured it last; None: not yet."""

    round_trip_s: float | None


class Start(_Message, frozen=True, tag=True):
    request: dict[str, Any]


class Cancel(_Message, frozen=True, tag=True):
    behavior: str
    epoch: int


class Adjust(_Message, frozen=True, tag=True):
    behavior: str
    epoch: int
    parameters: dict[str, Any]


class Query(_Message, frozen=True, tag=True):
    behavior: str
    native_ref: str | None
    epoch: int


class Hold(_Message, frozen=True, tag=True):
    resource: str


class Resume(_Message, frozen=True, tag=True):
    resource: str


class Reclaim(_Message, frozen=True, tag=True):
    resource: str


class Fence(_Message, frozen=True, tag=True):
    run: str
    epoch: int


Body: TypeAlias = Hello | Ping | Start | Cancel | Adjust | Query | Hold | Resume | Reclaim | Fence


class Request(_Message, frozen=True):
    """`executive`: a process. `journal`: of that executive. `contact`: as the host has named it in
    `Welcome`; "" before. A `Ping` has neither `id` nor `journal`."""

    id: str
    executive: str
    journal: str
    contact: str
    body: Body


# --- what the host answers ----------------------------------------------------------------------


class Welcome(_Message, frozen=True, tag=True):
    """There is contact. `store`: which numbers of items belong together."""

    contact: str
    store: str
    time_us: int


class Done(_Message, frozen=True, tag=True):
    """`text`: what `reclaim` returned, else "". `time_us`: of the host's clock."""

    time_us: int
    text: str = ""


class Found(_Message, frozen=True, tag=True):
    """The answer to `Query`. `resources`: of the behavior, if the host knows them."""

    report: bytes
    resources: tuple[str, ...]


class Refused(_Message, frozen=True, tag=True):
    """`code`: why, for programs: NO_CONTACT, SUPERSEDED, IN_USE, STALE_EPOCH, VERSION, FAILED.
    `newest`: with STALE_EPOCH, the epoch that was seen."""

    code: str
    reason: str
    newest: int = 0


Answer: TypeAlias = Welcome | Done | Found | Refused

# --- what the host reports ----------------------------------------------------------------------


class Item(_Message, frozen=True):
    """A report, a state with detections, or a note. `number` rises in the order of their coming."""

    number: int
    kind: str
    content: bytes


class Items(_Message, frozen=True):
    """Delivered until the executive has said up to which number it has them."""

    store: str
    items: tuple[Item, ...]


class Received(_Message, frozen=True):
    number: int


REPORT, STATE, NOTE = "report", "state", "note"
"""Kinds of items; a note is a text for operators."""

_encoder = msgspec.msgpack.Encoder()

LARGEST_STATES = 10_000_000
"""Bytes of a message of states, which is compressed: the most that is read."""

_OFTEN = _encoder.encode(
    {
        "resource": "",
        "time_us": 1_800_000_000_000_000,
        "position": {"latitude_deg": 0.0, "longitude_deg": 0.0, "altitude_m": 0.0},
        "altitude_above_home_m": None,
        "velocity_enu_m_s": [0.0, 0.0, 0.0],
        **{"roll_rad": 0.0, "pitch_rad": 0.0, "yaw_rad": 0.0, "battery_fraction": 0.0},
        **{"mode": "", "armed": True, "ready": True, "not_ready_reasons": []},
        **{"link": "CONNECTED", "behavior": ""},
    }
)
"""What a state is alike in, so that compression leaves of one little but its numbers. With another
one, an end does not understand what the other has compressed: it belongs to `VERSION`."""


def encode(message: msgspec.Struct) -> bytes:
    """Return a message as bytes."""
    return _encoder.encode(message)


def decode(content: bytes, type_: Any) -> Any:
    """Return the message of a type.

    Raises:
        MessageError: it is none.
    """
    try:
        return msgspec.msgpack.decode(content, type=type_)
    except (msgspec.MsgspecError, UnicodeDecodeError) as error:
        raise MessageError(f"not a message of this version: {error}") from error


# --- requests, reports and states of m2pem.api --------------------------------------------------

_GEOMETRIES: Mapping[str, type[Any]] = {
    "point": Point,
    "route": Route,
    "area": Area,
    "vehicle": VehiclePosition,
}
_KINDS = {type_: kind for kind, type_ in _GEOMETRIES.items()}


def plain_parameters(parameters: Mapping[str, ResolvedValue]) -> dict[str, Any]:
    """Return parameters with their geometries as maps."""
    return {
        name: {"kind": kind, "geometry": msgspec.to_builtins(value)}
        if (kind := _KINDS.get(type(value)))
        else value
        for name, value in parameters.items()
    }


def resolved_parameters(plain: Mapping[str, Any]) -> dict[str, ResolvedValue]:
    """Return what `plain_parameters` was given.

    Raises:
        MessageError: it was not given this.
    """
    try:
        return {
            name: msgspec.convert(value["geometry"], _GEOMETRIES[value["kind"]])
            if isinstance(value, dict)
            else value
            for name, value in plain.items()
        }
    except (msgspec.MsgspecError, KeyError) as error:
        raise MessageError(f"parameters: {error}") from error


def plain_request(request: BehaviorRequest) -> dict[str, Any]:
    """Return a request for a behavior as a map."""
    return {
        "id": request.id,
        "epoch": request.epoch,
        "behavior": request.behavior,
        "parameters": plain_parameters(request.parameters),
        "resources": list(request.resources),
        "roles": {role: list(who) for role, who in request.roles.items()},
        "preempts": list(request.preempts),
    }


def behavior_request(plain: Mapping[str, Any]) -> BehaviorRequest:
    """Return what `plain_request` was given.

    Raises:
        MessageError: it was not given this.
    """
    parameters = resolved_parameters(plain.get("parameters", {}))
    try:
        return msgspec.convert({**plain, "parameters": {}}, _WithoutParameters).with_(parameters)
    except msgspec.MsgspecError as error:
        raise MessageError(f"a request for a behavior: {error}") from error


class _WithoutParameters(msgspec.Struct, frozen=True):
    id: str
    epoch: int
    behavior: str
    resources: tuple[str, ...]
    roles: dict[str, tuple[str, ...]]
    preempts: tuple[str, ...]

    def with_(self, parameters: Mapping[str, ResolvedValue]) -> BehaviorRequest:
        ids = {role: tuple(map(ResourceId, who)) for role, who in self.roles.items()}
        resources = tuple(map(ResourceId, self.resources))
        return BehaviorRequest(
            self.id, self.epoch, self.behavior, parameters, resources, ids, self.preempts
        )


def encode_report(report: BehaviorReport) -> bytes:
    """Return a report as bytes."""
    return _encoder.encode(report)


def decode_report(content: bytes) -> BehaviorReport:
    """Return what `encode_report` was given; raises MessageError."""
    report = decode(content, BehaviorReport)
    assert isinstance(report, BehaviorReport)
    return report


def encode_states(states: Sequence[VehicleState | PayloadState]) -> bytes:
    """Return states as bytes."""
    compressor = zlib.compressobj(zlib.Z_BEST_COMPRESSION, zdict=_OFTEN)
    plain = _encoder.encode([(isinstance(each, PayloadState), each) for each in states])
    return compressor.compress(plain) + compressor.flush()


def decode_states(content: bytes) -> list[VehicleState | PayloadState]:
    """Return what `encode_states` was given; raises MessageError."""
    decompressor = zlib.decompressobj(zdict=_OFTEN)
    try:
        plain = decompressor.decompress(content, LARGEST_STATES)
    except zlib.error as error:
        raise MessageError(f"not a message of this version: {error}") from error
    return [
        decode(bytes(each), PayloadState if is_of_payload else VehicleState)
        for is_of_payload, each in decode(plain, list[tuple[bool, msgspec.Raw]])
    ]
