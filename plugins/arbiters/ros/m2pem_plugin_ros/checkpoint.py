"""Checkpoints of behaviors: what is stored to find a behavior on its vehicle after a restart.

A checkpoint is a short JSON text, the `native_ref` of reports. It has the resources, the behavior
and its parameters, without areas and long routes. The ids of goals and runs are derived from the
ids of behaviors, and are the same after a restart.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from uuid import UUID, uuid5

from m2pem.api import BehaviorId, Point, ResolvedValue, ResourceId, Route, VehiclePosition

LONGEST_ROUTE = 300
"""In waypoints. Longer routes are left out, as every report carries the text."""

_VERSION = 1


@dataclass(frozen=True, slots=True)
class Checkpoint:
    resources: tuple[ResourceId, ...]
    behavior: str
    epoch: int
    parameters: Mapping[str, ResolvedValue]


def encode_checkpoint(checkpoint: Checkpoint) -> str:
    encoded = {name: _encode_value(value) for name, value in checkpoint.parameters.items()}
    whole = {
        "v": _VERSION,
        "resources": list(checkpoint.resources),
        "behavior": checkpoint.behavior,
        "epoch": checkpoint.epoch,
        "parameters": {name: value for name, value in encoded.items() if value is not None},
    }
    return json.dumps(whole, separators=(",", ":"))


def decode_checkpoint(text: str) -> Checkpoint | None:
    """Return the checkpoint; None if the text was not made by `encode_checkpoint`."""
    try:
        whole = json.loads(text)
        if whole["v"] != _VERSION:
            return None
        resources = tuple(ResourceId(str(resource)) for resource in whole["resources"])
        parameters = {
            str(name): _decode_value(value) for name, value in whole["parameters"].items()
        }
        return Checkpoint(resources, str(whole["behavior"]), int(whole["epoch"]), parameters)
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return None


def _encode_value(value: ResolvedValue) -> Any:
    match value:
        case Point():
            return {"point": list(value.position), "frame": value.altitude_frame}
        case Route() if len(value.waypoints) <= LONGEST_ROUTE:
            return {"route": [list(w) for w in value.waypoints], "frame": value.altitude_frame}
        case VehiclePosition():
            return {"vehicle": value.vehicle}
        case bool() | int() | float() | str():
            return value
        case _:
            return None


def _decode_value(value: Any) -> ResolvedValue:
    if not isinstance(value, dict):
        return value  # type: ignore[no-any-return]  # a number or text of JSON
    if "vehicle" in value:
        return VehiclePosition(str(value["vehicle"]))
    if "route" in value:
        return Route(tuple(_coordinate(each) for each in value["route"]), str(value["frame"]))
    return Point(_coordinate(value["point"]), str(value["frame"]))


def _coordinate(value: Any) -> tuple[float, float, float | None]:
    latitude, longitude, altitude = value
    return float(latitude), float(longitude), None if altitude is None else float(altitude)


def goal_id(journal: UUID, behavior: BehaviorId) -> UUID:
    """Return the goal of a behavior: the same after a restart, and different for each journal."""
    return uuid5(journal, behavior)


def run_id(journal: UUID, behavior: BehaviorId) -> UUID:
    """Return the run of a behavior: "r1.b3" belongs to run "r1"."""
    return uuid5(journal, behavior.partition(".")[0])
