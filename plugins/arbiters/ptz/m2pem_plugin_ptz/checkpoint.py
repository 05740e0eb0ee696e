"""What is kept of a behavior outside of this process: enough to recognise it on the camera.

A short text of JSON: which camera, which behavior, its parameters but for areas, and since when.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from m2pem.api import Point, ResolvedValue, ResourceId, VehiclePosition

_VERSION = 1


@dataclass(frozen=True, slots=True)
class Kept:
    """What a reference says. `began_us`: when it was started, microseconds since the Unix epoch."""

    resource: ResourceId
    behavior: str
    parameters: Mapping[str, ResolvedValue]
    began_us: int


def native_ref(kept: Kept) -> str:
    """The text."""
    parameters = {
        name: _encoded(value)
        for name, value in kept.parameters.items()
        if isinstance(value, float | int | str | Point | VehiclePosition)
    }
    whole = {
        "v": _VERSION,
        "camera": kept.resource,
        "behavior": kept.behavior,
        "parameters": parameters,
        "began_us": kept.began_us,
    }
    return json.dumps(whole, separators=(",", ":"))


def read_native_ref(text: str) -> Kept | None:
    """What a text says; None: it was not made by `native_ref`."""
    try:
        whole = json.loads(text)
        if whole["v"] != _VERSION:
            return None
        parameters = {str(name): _decoded(value) for name, value in whole["parameters"].items()}
        resource, behavior = ResourceId(str(whole["camera"])), str(whole["behavior"])
        return Kept(resource, behavior, parameters, int(whole["began_us"]))
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return None


def _encoded(value: float | int | str | Point | VehiclePosition) -> Any:
    if isinstance(value, Point):
        return {"point": list(value.position), "frame": value.altitude_frame}
    if isinstance(value, VehiclePosition):
        return {"vehicle": value.vehicle}
    return value


def _decoded(value: Any) -> ResolvedValue:
    if not isinstance(value, dict):
        return value  # type: ignore[no-any-return]  # a number or text of JSON
    if "vehicle" in value:
        return VehiclePosition(str(value["vehicle"]))
    latitude, longitude, altitude = value["point"]
    return Point((float(latitude), float(longitude), altitude), str(value["frame"]))
