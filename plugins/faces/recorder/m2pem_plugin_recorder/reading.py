"""Reads recordings back, also files that a killed process or a full disk left without an end."""

import struct
from collections.abc import Iterator, Sequence
from io import SEEK_CUR, BytesIO
from pathlib import Path
from typing import Any

import msgspec
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel as McapChannel
from mcap.records import Chunk as McapChunk
from mcap.records import Message as McapMessage
from mcap.records import Schema as McapSchema
from mcap.stream_reader import MAGIC_SIZE, StreamReader, get_chunk_data_stream

from m2pem.api import PayloadState, TeamState, Telemetry, VehicleState
from m2pem_plugin_recorder.channels import RECORDS, TELEMETRY, Channel, ChannelMessage, Schema

_HEAD = struct.Struct("<BQ")
"""How each record of MCAP begins: opcode, and length of the rest."""

_MESSAGE = struct.Struct("<HI")
"""How a message goes on: channel, and sequence."""

_TORN = (McapError, zstandard.ZstdError, EOFError, ValueError, KeyError, struct.error)
"""What the end of a torn file looks like to the reader of MCAP and its decompressor."""


def messages_of(path: Path, topics: Sequence[str] = ()) -> Iterator[ChannelMessage]:
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
                            yield ChannelMessage(
                                channel, record.log_time // 1000, record.data, record.sequence
                            )
        except _TORN:
            return


def last_record(paths: Sequence[Path]) -> int:
    """Return the number up to which files have all records of their run; 0: they have none."""
    last = 0
    for path in paths:
        for number in _record_numbers(path):
            if number == last + 1:
                last = number
    return last


def _record_numbers(path: Path) -> Iterator[int]:
    """Yield the numbers of the records in a file, up to its end or to where it is torn.

    Other messages are skipped unread: an executive that takes runs up after a crash has no time to
    decode gigabytes of telemetry.
    """
    records: set[int] = set()
    with path.open("rb") as file:
        file.seek(MAGIC_SIZE)
        try:
            while True:
                opcode, length = _HEAD.unpack(file.read(_HEAD.size))
                if opcode != Opcode.CHUNK:
                    file.seek(length, SEEK_CUR)
                    continue
                chunk = McapChunk.read(ReadDataStream(BytesIO(file.read(length))))
                stream, size = get_chunk_data_stream(chunk)
                yield from _numbers_in(stream.read(size), records)
        except _TORN:
            return


def _numbers_in(data: bytes, records: set[int]) -> Iterator[int]:
    """Yield the numbers of the records in a chunk. `records`: the ids of their channels so far."""
    at = 0
    while at < len(data):
        opcode, length = _HEAD.unpack_from(data, at)
        at += _HEAD.size
        if opcode == Opcode.MESSAGE:
            channel, sequence = _MESSAGE.unpack_from(data, at)
            if channel in records:
                yield sequence
        elif opcode == Opcode.CHANNEL:
            found = McapChannel.read(ReadDataStream(BytesIO(data[at : at + length])))
            if found.topic == RECORDS:
                records.add(found.id)
        at += length


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
