"""Checkpoints of behaviors: what is stored to find a behavior on its camera after a restart.

A checkpoint is a short JSON text, the `native_ref` of reports: the camera, the behavior, its
parameters without areas, and its start.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from m2pem.api import Point, ResolvedValue, ResourceId, VehiclePosition

_VERSION = 1


@dataclass(frozen=True, slots=True)
class Checkpoint:
    """`began_us`: when it was started, in microseconds since the Unix epoch."""

    resource: ResourceId
    behavior: str
    parameters: Mapping[str, ResolvedValue]
    began_us: int


def encode_checkpoint(checkpoint: Checkpoint) -> str:
    parameters = {
        name: _encode_value(value)
        for name, value in checkpoint.parameters.items()
        if isinstance(value, float | int | str | Point | VehiclePosition)
    }
    whole = {
        "v": _VERSION,
        "camera": checkpoint.resource,
        "behavior": checkpoint.behavior,
        "parameters": parameters,
        "began_us": checkpoint.began_us,
    }
    return json.dumps(whole, separators=(",", ":"))


def decode_checkpoint(text: str) -> Checkpoint | None:
    """Return the checkpoint; None if the text was not made by `encode_checkpoint`."""
    try:
        whole = json.loads(text)
        if whole["v"] != _VERSION:
            return None
        parameters = {
            str(name): _decode_value(value) for name, value in whole["parameters"].items()
        }
        resource, behavior = ResourceId(str(whole["camera"])), str(whole["behavior"])
        return Checkpoint(resource, behavior, parameters, int(whole["began_us"]))
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return None


def _encode_value(value: float | int | str | Point | VehiclePosition) -> Any:
    if isinstance(value, Point):
        return {"point": list(value.position), "frame": value.altitude_frame}
    if isinstance(value, VehiclePosition):
        return {"vehicle": value.vehicle}
    return value


def _decode_value(value: Any) -> ResolvedValue:
    if not isinstance(value, dict):
        return value  # type: ignore[no-any-return]  # a number or text of JSON
    if "vehicle" in value:
        return VehiclePosition(str(value["vehicle"]))
    latitude, longitude, altitude = value["point"]
    return Point((float(latitude), float(longitude), altitude), str(value["frame"]))
