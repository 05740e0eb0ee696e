"""Checkpoints of behaviors, which reattach to them after a restart.

A checkpoint is a short JSON text, the `native_ref` of a report. It has the vehicle, the behavior,
its parameters except routes and areas, the behavior's own state (such as the fingerprint of its
mission), and a snapshot of the vehicle when the behavior was accepted.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from m2pem.api import ResolvedValue, ResourceId, decode_parameters, encode_parameters

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
    whole = {
        "v": _VERSION,
        "vehicle": checkpoint.resource,
        "behavior": checkpoint.behavior,
        "parameters": encode_parameters(checkpoint.parameters),
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
        parameters = decode_parameters(whole["parameters"])
        resource = ResourceId(str(whole["vehicle"]))
        before = VehicleSnapshot(**whole["before"]) if whole.get("before") else None
        return Checkpoint(
            resource, str(whole["behavior"]), parameters, dict(whole["memory"]), before
        )
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return None
