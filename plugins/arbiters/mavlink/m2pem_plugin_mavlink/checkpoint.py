"""Checkpoints of behaviors, which reattach to them after a restart.

A checkpoint is a short JSON text, the `native_ref` of a report. It has the vehicle, the behavior,
its parameters except routes and areas, the behavior's own state (such as the fingerprint of its
mission), and a snapshot of the vehicle when the behavior was accepted.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from m2pem.api import Point, ResolvedValue, ResourceId, VehiclePosition

_VERSION = 1


@dataclass(frozen=True, slots=True)
class VehicleSnapshot:
    """A vehicle at the moment at which a behavior was accepted. Degrees; metres above home.

    `at_s`: by the arbiter's clock, which continues over a restart.
    """

    at_s: float
    armed: bool
    landed: bool
    custom_mode: int
    latitude_deg: float
    longitude_deg: float
    altitude_m: float


@dataclass(frozen=True, slots=True)
class Checkpoint:
    """`state`: as returned by `Behavior.checkpoint`. `before`: None if the vehicle had not reported
    all of it, or if an older release wrote the checkpoint."""

    resource: ResourceId
    behavior: str
    parameters: Mapping[str, ResolvedValue]
    state: Mapping[str, Any]
    before: VehicleSnapshot | None = None


def encode_checkpoint(checkpoint: Checkpoint) -> str:
    """Return the checkpoint as a JSON text."""
    parameters = {
        name: _encoded(value)
        for name, value in checkpoint.parameters.items()
        if isinstance(value, float | int | str | Point | VehiclePosition)
    }
    whole = {
        "v": _VERSION,
        "vehicle": checkpoint.resource,
        "behavior": checkpoint.behavior,
        "parameters": parameters,
        "memory": dict(checkpoint.state),
        "before": asdict(checkpoint.before) if checkpoint.before is not None else None,
    }
    return json.dumps(whole, separators=(",", ":"))


def decode_checkpoint(text: str) -> Checkpoint | None:
    """Return the checkpoint in a text; None if `encode_checkpoint` has not made the text."""
    try:
        whole = json.loads(text)
        if whole["v"] != _VERSION:
            return None
        parameters = {name: _decoded(value) for name, value in whole["parameters"].items()}
        resource = ResourceId(str(whole["vehicle"]))
        before = VehicleSnapshot(**whole["before"]) if whole.get("before") else None
        return Checkpoint(
            resource, str(whole["behavior"]), parameters, dict(whole["memory"]), before
        )
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
