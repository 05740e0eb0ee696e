"""Messages of the mission protocol with the ids of plans, which pymavlink 2.4.50 does not have."""

from collections.abc import Sequence
from functools import cache
from struct import Struct
from types import SimpleNamespace
from zlib import crc32

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.protocol.messages import Message, MessageType, message_type_of

_IDS = {
    "MISSION_COUNT": ("opaque_id",),
    "MISSION_ACK": ("opaque_id",),
    "MISSION_CURRENT": ("mission_id", "fence_id", "rally_points_id"),
}
"""Extension fields of common.xml, each of the type uint32_t."""


@cache
def plan_message(name: str) -> MessageType:
    """Return a message type with its ids of plans."""
    ids, source = _IDS[name], dialect.mavlink_map[getattr(dialect, f"MAVLINK_MSG_ID_{name}")]
    extended = SimpleNamespace(
        id=source.id,
        msgname=source.msgname,
        crc_extra=source.crc_extra,
        fieldnames=[*source.fieldnames, *ids],
        fieldtypes=[*source.fieldtypes, *["uint32_t"] * len(ids)],
        ordered_fieldnames=[*source.ordered_fieldnames, *ids],
        lengths=[*source.lengths, *[1] * len(ids)],
        array_lengths=[*source.array_lengths, *[0] * len(ids)],
        unpacker=Struct(source.unpacker.format + "I" * len(ids)),
    )
    return message_type_of(extended)


def plan_id(items: Sequence[Message]) -> int:
    """Return the id of a plan, which is another one for another plan; 0: it has no items."""
    own = (each._replace(target_system=0, target_component=0, current=0) for each in items)
    return (crc32(b"".join(each.TYPE.pack(each) for each in own)) or 1) if items else 0
