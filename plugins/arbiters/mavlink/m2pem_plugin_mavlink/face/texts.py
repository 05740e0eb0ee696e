"""STATUSTEXT: what a vehicle, or m2pem about it, has to say to ground stations."""

from collections.abc import Iterator
from enum import IntEnum
from itertools import count

from m2pem_plugin_mavlink.protocol.messages import Message, message_type

CHUNK_BYTES = 50
MOST_BYTES = 200


class TextSeverity(IntEnum):
    """MAV_SEVERITY, as far as it is used."""

    ERROR = 3
    WARNING = 4
    INFO = 6


_IDS: Iterator[int] = count()


def status_texts(text: str, severity: TextSeverity) -> list[Message]:
    """Return a text as messages, in chunks; a very long one is cut."""
    printable = "".join(each if each.isprintable() else " " for each in text)
    data = printable.encode()
    if len(data) > MOST_BYTES:
        data = data[: MOST_BYTES - 3].decode(errors="ignore").encode() + b"..."
    chunks = [data[at : at + CHUNK_BYTES] for at in range(0, len(data), CHUNK_BYTES)] or [b""]
    id_ = next(_IDS) % 0xFFFF + 1 if len(chunks) > 1 else 0
    make = message_type("STATUSTEXT").make
    return [
        make(severity=severity, text=chunk, id=id_, chunk_seq=number)
        for number, chunk in enumerate(chunks)
    ]
