"""What is kept of a behavior outside of this process: enough to recognise it on the vehicle.

A short text of JSON: which vehicle, which behavior, its parameters but for routes and areas, what
the behavior itself wants to remember, such as the fingerprint of its mission, and how the vehicle
was before it.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from m2pem.api import Point, ResolvedValue, ResourceId, VehiclePosition

_VERSION = 1


@dataclass(frozen=True, slots=True)
class Before:
    """How a vehicle was when a behavior was accepted: it shows later whether that has begun.

    `at_s`: by the arbiter's clock, which goes on over a restart. Degrees; metres above home.
    """

    at_s: float
    armed: bool
    landed: bool
    custom_mode: int
    latitude_deg: float
    longitude_deg: float
    altitude_m: float


@dataclass(frozen=True, slots=True)
class Kept:
    """What a reference says. `memory`: as the behavior said it. `before`: None if something of it
    was not received yet, or the reference is of a release that did not keep it."""

    resource: ResourceId
    behavior: str
    parameters: Mapping[str, ResolvedValue]
    memory: Mapping[str, Any]
    before: Before | None = None


def native_ref(kept: Kept) -> str:
    """The text."""
    parameters = {
        name: _encoded(value)
        for name, value in kept.parameters.items()
        if isinstance(value, float | int | str | Point | VehiclePosition)
    }
    whole = {
        "v": _VERSION,
        "vehicle": kept.resource,
        "behavior": kept.behavior,
        "parameters": parameters,
        "memory": dict(kept.memory),
        "before": asdict(kept.before) if kept.before is not None else None,
    }
    return json.dumps(whole, separators=(",", ":"))


def read_native_ref(text: str) -> Kept | None:
    """What a text says; None: it was not made by `native_ref`."""
    try:
        whole = json.loads(text)
        if whole["v"] != _VERSION:
            return None
        parameters = {name: _decoded(value) for name, value in whole["parameters"].items()}
        resource = ResourceId(str(whole["vehicle"]))
        before = Before(**whole["before"]) if whole.get("before") else None
        return Kept(resource, str(whole["behavior"]), parameters, dict(whole["memory"]), before)
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
