"""The messages of MAVLink, as named tuples made from pymavlink's tables of the dialect.

A message is a tuple of its fields, in the order in which they travel (mavlink.io, "Serialization").
Fields that are left out are 0; texts are bytes without their padding; arrays are tuples. The
dialect is ardupilotmega, which contains common:

    COMMAND_LONG = message_type("COMMAND_LONG")
    COMMAND_LONG.make(target_system=1, command=400, param1=1.0)
"""

from collections import namedtuple
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import accumulate
from struct import Struct
from typing import Any, ClassVar, NamedTuple, Protocol, cast

from pymavlink.dialects.v20 import ardupilotmega as dialect


class Address(NamedTuple):
    """The address of a sender or receiver (mavlink.io, "Routing"). Component 1 is the autopilot."""

    system: int
    component: int

    @property
    def as_target(self) -> dict[str, int]:
        """The fields of a message that is sent there."""
        return {"target_system": self.system, "target_component": self.component}


class Message(Protocol):
    """A message: its fields are attributes of the names that the dialect gives them."""

    TYPE: ClassVar["MessageType"]

    def __getattr__(self, field: str) -> Any: ...

    def __iter__(self) -> Iterator[Any]: ...

    def _replace(self, **fields: Any) -> "Message": ...


class MessageMaker(Protocol):
    """The named tuple of a message type."""

    _fields: tuple[str, ...]

    def __call__(self, **fields: Any) -> Message: ...

    def _make(self, items: Iterable[Any]) -> Message: ...


@dataclass(frozen=True, slots=True, eq=False)
class MessageType:
    """The type of all messages with one id.

    `make(field=value, ...)` makes a message; `struct` is the whole payload, extensions included;
    `spans` has where the items of each field are among those of the struct (None: each field is one
    item); `texts`: which fields are texts.
    """

    id: int
    name: str
    crc_extra: int
    struct: Struct
    make: MessageMaker
    spans: tuple[slice | int, ...] | None
    texts: tuple[int, ...]

    def unpack(self, payload: bytes) -> Any:
        """Return the message in a payload. The payload may lack trailing zeros, or have the fewer
        or more extension fields of an older or newer version."""
        size = self.struct.size
        if len(payload) != size:
            payload = payload[:size].ljust(size, b"\0")
        items: Sequence[Any] = self.struct.unpack(payload)
        if self.spans is not None:
            items = [items[span] for span in self.spans]
        if self.texts:
            items = list(items)
            for index in self.texts:
                items[index] = items[index].partition(b"\0")[0]
        return self.make._make(items)

    def pack(self, message: Message) -> bytes:
        """Return the complete payload of a message.

        Raises:
            struct.error: a field's value does not fit its type.
        """
        items: Iterable[Any] = message
        if self.spans is not None:
            spread: list[Any] = []
            for span, value in zip(self.spans, message, strict=True):
                if isinstance(span, slice):
                    spread.extend(value)
                else:
                    spread.append(value)
            items = spread
        return self.struct.pack(*items)


@cache
def types_by_id() -> dict[int, MessageType]:
    """Return every message type of the dialect."""
    return {id_: message_type_of(source) for id_, source in dialect.mavlink_map.items()}


@cache
def _types_by_name() -> dict[str, MessageType]:
    return {each.name: each for each in types_by_id().values()}


def message_type(name: str) -> MessageType:
    """Return a message type by its name.

    Raises:
        KeyError: the dialect has no such message.
    """
    return _types_by_name()[name]


def message_type_of(source: Any) -> MessageType:
    """Return the type of a message, given pymavlink's class of it, of any dialect."""
    types = dict(zip(source.fieldnames, source.fieldtypes, strict=True))
    fields: Sequence[str] = source.ordered_fieldnames
    lengths: Sequence[int] = source.lengths
    starts = accumulate(lengths, initial=0)
    spans: list[slice | int] = []
    defaults: list[Any] = []
    for name, start, length, array in zip(fields, starts, lengths, source.array_lengths):  # noqa: B905  # `starts` has one more
        if types[name] == "char":
            spans.append(start)
            defaults.append(b"")
        elif array:
            spans.append(slice(start, start + length))
            defaults.append((0,) * length)
        else:
            spans.append(start)
            defaults.append(0)
    made = cast("Any", namedtuple(source.msgname, fields, defaults=defaults))
    made.TYPE = MessageType(
        source.id,
        source.msgname,
        source.crc_extra,
        source.unpacker,
        made,
        tuple(spans) if any(isinstance(span, slice) for span in spans) else None,
        tuple(index for index, name in enumerate(fields) if types[name] == "char"),
    )
    type_: MessageType = made.TYPE
    return type_
