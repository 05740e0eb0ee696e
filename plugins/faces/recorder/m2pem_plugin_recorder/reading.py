"""Reads recordings back, also files that a killed process or a full disk left without an end."""

import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import zstandard
from mcap.exceptions import McapError
from mcap.records import Channel as McapChannel
from mcap.records import Message as McapMessage
from mcap.records import Schema as McapSchema
from mcap.stream_reader import StreamReader

from m2pem.api import PayloadState, TeamState, Telemetry, VehicleState
from m2pem_plugin_recorder.channels import RECORDS, TELEMETRY, Channel, Schema

_TORN = (McapError, zstandard.ZstdError, EOFError, ValueError, KeyError, struct.error)
"""What the end of a torn file looks like to the reader of MCAP and its decompressor."""


class RecordedMessage(NamedTuple):
    """A message of a recording."""

    channel: Channel
    time_us: int
    sequence: int
    data: bytes


def messages_of(path: Path, topics: Sequence[str] = ()) -> Iterator[RecordedMessage]:
    """Yield the messages of a file in the order in which they were written, up to its end or to
    where it is torn. `topics`: only these; none: all.

    Raises:
        OSError: it cannot be read.
    """
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    with path.open("rb") as file:
        try:
            for record in StreamReader(file).records:
                match record:
                    case McapSchema(id=key, name=name, encoding=encoding, data=data):
                        schemas[key] = Schema(name, encoding, data)
                    case McapChannel(id=key, topic=topic, schema_id=schema):
                        known = schemas.get(schema, Schema("", "", b""))
                        channels[key] = Channel(topic, record.message_encoding, known)
                    case McapMessage():
                        channel = channels[record.channel_id]
                        if not topics or channel.topic in topics:
                            yield RecordedMessage(
                                channel, record.log_time // 1000, record.sequence, record.data
                            )
        except _TORN:
            return


def last_record(paths: Sequence[Path]) -> int:
    """Return the number up to which files have all records of their run; 0: they have none."""
    last = 0
    for path in paths:
        for message in messages_of(path, (RECORDS,)):
            if message.sequence == last + 1:
                last = message.sequence
    return last


class _Telemetry(msgspec.Struct):
    kind: str
    state: msgspec.Raw


_telemetry = msgspec.json.Decoder(_Telemetry)
_STATES: dict[str, Any] = {
    "vehicle": msgspec.json.Decoder(VehicleState),
    "payload": msgspec.json.Decoder(PayloadState),
    "team": msgspec.json.Decoder(TeamState),
}


def telemetry_of(paths: Sequence[Path]) -> Iterator[Telemetry]:
    """Yield the states in files, in the order in which they were written.

    Raises:
        OSError: a file cannot be read.
    """
    for path in paths:
        for message in messages_of(path, (TELEMETRY,)):
            try:
                found = _telemetry.decode(message.data)
                decoder = _STATES.get(found.kind)
                if decoder is not None:
                    yield decoder.decode(found.state)
            except (ValueError, msgspec.DecodeError):  # a device sent what a state cannot have
                continue
