"""Channels and their messages, for recordings (MCAP) and for live viewers (Foxglove)."""

from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import msgspec

from m2pem.api import PayloadState, Record, TeamState, VehicleState

RECORDS = "/m2pem/records"
TELEMETRY = "/m2pem/telemetry"
PROMPTS = "/m2pem/prompts"
PICTURES = "/m2pem/pictures"
LOG = "/m2pem/log"
SCENE = "/m2pem/scene"
GEOMETRIES = "/m2pem/geometries"
TRANSFORMS = "/tf"


@dataclass(frozen=True, slots=True)
class Schema:
    """A schema as MCAP has it. `encoding`: `jsonschema`, `protobuf` or `ros2msg`."""

    name: str
    encoding: str
    data: bytes


@dataclass(frozen=True, slots=True)
class Channel:
    """A topic, with the schema and the encoding (`json`, `protobuf`, `cdr`) of its messages."""

    topic: str
    encoding: str
    schema: Schema


class ChannelMessage(NamedTuple):
    """An encoded message. `time_us`: microseconds since the Unix epoch, by the executive's clock.

    `sequence`: of a record, its number in the run; else 0.
    """

    channel: Channel
    time_us: int
    data: bytes
    sequence: int = 0


class PromptMessage(msgspec.Struct, omit_defaults=True):
    """A question to operators, and what became of it: `open`, `answered` or `withdrawn`."""

    run: str
    prompt: str
    state: str
    element: str = ""
    text: str = ""
    role: str = ""
    decisions: tuple[dict[str, str], ...] = ()
    decision: str = ""
    by: str = ""


class PicturesMessage(msgspec.Struct):
    """Pictures that a camera has taken: where their files are, as its arbiter says."""

    run: str
    element: str
    files: list[str]


class TelemetryMessage(msgspec.Struct):
    """The state of a vehicle, payload or team. `kind`: `vehicle`, `payload` or `team`."""

    kind: str
    state: VehicleState | PayloadState | TeamState


@cache
def json_channel(topic: str, name: str, type_: Any) -> Channel:
    """Return a channel of JSON messages of a type that msgspec knows."""
    return Channel(topic, "json", Schema(name, "jsonschema", msgspec.json.encode(_schema(type_))))


@cache
def records_channel() -> Channel:
    """The channel of the records of a run: the lines of `m2pem runs --export` (docs/records.md)."""
    schema = msgspec.json.schema(Record)
    found = {
        "title": "m2pem.Record",
        "type": "object",
        "properties": {
            "run": {"type": "string"},
            "seq": {"type": "integer", "minimum": 1, "description": "number in the run"},
            "t": {"type": "number", "description": "mission time in seconds"},
            "record": {"type": "string", "description": "kind of the record"},
        },
        "required": ["run", "seq", "t", "record"],
        "anyOf": schema["anyOf"],
        "$defs": schema["$defs"],
    }
    return Channel(
        RECORDS, "json", Schema("m2pem.Record", "jsonschema", msgspec.json.encode(found))
    )


@cache
def telemetry_channel() -> Channel:
    """The channel of the states of all vehicles and payloads, as m2pem has them."""
    states = {
        kind: {"$ref": f"#/$defs/{type_.__name__}"}
        for kind, type_ in (("vehicle", VehicleState), ("payload", PayloadState))
    }
    _, definitions = msgspec.json.schema_components(
        (VehicleState, PayloadState, TeamState), ref_template="#/$defs/{name}"
    )
    found = {
        "title": "m2pem.Telemetry",
        "type": "object",
        "properties": {
            "kind": {"enum": ["vehicle", "payload", "team"]},
            "state": {"anyOf": [*states.values(), {"$ref": "#/$defs/TeamState"}]},
        },
        "required": ["kind", "state"],
        "$defs": definitions,
    }
    data = msgspec.json.encode(found)
    return Channel(TELEMETRY, "json", Schema("m2pem.Telemetry", "jsonschema", data))


def prompts_channel() -> Channel:
    """The channel of questions to operators and their answers."""
    return json_channel(PROMPTS, "m2pem.Prompt", PromptMessage)


def pictures_channel() -> Channel:
    """The channel of references to the pictures of cameras."""
    return json_channel(PICTURES, "m2pem.Pictures", PicturesMessage)


def _schema(type_: Any) -> dict[str, Any]:
    """Return a JSON schema whose top is an object, as viewers expect it."""
    (reference,), definitions = msgspec.json.schema_components(
        (type_,), ref_template="#/$defs/{name}"
    )
    name = reference["$ref"].rpartition("/")[2]
    top = definitions.pop(name)
    return {**top, "$defs": definitions} if definitions else top
