"""Checkpoints of behaviors: what is kept to find one on its vehicle after a restart.

The checkpoint is a short text of JSON, the `native_ref` of reports: the resources, the behavior and
its parameters, without areas and without long routes. The ids of goals and runs are derived from
the ids of behaviors, and are the same after a restart.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from uuid import UUID, uuid5

from m2pem.api import BehaviorId, Point, ResolvedValue, ResourceId, Route, VehiclePosition

LONGEST_ROUTE = 300
"""In waypoints. Every report carries the text."""

_VERSION = 1


@dataclass(frozen=True, slots=True)
class Kept:
    """What a reference says."""

    resources: tuple[ResourceId, ...]
    behavior: str
    epoch: int
    parameters: Mapping[str, ResolvedValue]


def native_ref(kept: Kept) -> str:
    """The text."""
    encoded = {name: _encoded(value) for name, value in kept.parameters.items()}
    whole = {
        "v": _VERSION,
        "resources": list(kept.resources),
        "behavior": kept.behavior,
        "epoch": kept.epoch,
        "parameters": {name: value for name, value in encoded.items() if value is not None},
    }
    return json.dumps(whole, separators=(",", ":"))


def read_native_ref(text: str) -> Kept | None:
    """What a text says; None: it was not made by `native_ref`."""
    try:
        whole = json.loads(text)
        if whole["v"] != _VERSION:
            return None
        resources = tuple(ResourceId(str(resource)) for resource in whole["resources"])
        parameters = {str(name): _decoded(value) for name, value in whole["parameters"].items()}
        return Kept(resources, str(whole["behavior"]), int(whole["epoch"]), parameters)
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return None


def _encoded(value: ResolvedValue) -> Any:
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


def _decoded(value: Any) -> ResolvedValue:
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
    """The goal of a behavior: the same after a restart, and unlike that of any other journal."""
    return uuid5(journal, behavior)


def run_id(journal: UUID, behavior: BehaviorId) -> UUID:
    """The run that a behavior belongs to: "r1.b3" is of run "r1"."""
    return uuid5(journal, behavior.partition(".")[0])
