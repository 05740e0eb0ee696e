"""Checkpoints of behaviors: what is stored to find a behavior on its camera after a restart.

A checkpoint is a short JSON text, the `native_ref` of reports: the camera, the behavior, its
parameters without areas, and its start.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass

from m2pem.api import ResolvedValue, ResourceId, decode_parameters, encode_parameters

_VERSION = 1


@dataclass(frozen=True, slots=True)
class Checkpoint:
    """`began_us`: when it was started, in microseconds since the Unix epoch."""

    resource: ResourceId
    behavior: str
    parameters: Mapping[str, ResolvedValue]
    began_us: int


def encode_checkpoint(checkpoint: Checkpoint) -> str:
    whole = {
        "v": _VERSION,
        "camera": checkpoint.resource,
        "behavior": checkpoint.behavior,
        "parameters": encode_parameters(checkpoint.parameters),
        "began_us": checkpoint.began_us,
    }
    return json.dumps(whole, separators=(",", ":"))


def decode_checkpoint(text: str) -> Checkpoint | None:
    """Return the checkpoint; None if the text was not made by `encode_checkpoint`."""
    try:
        whole = json.loads(text)
        if whole["v"] != _VERSION:
            return None
        parameters = decode_parameters(whole["parameters"])
        resource, behavior = ResourceId(str(whole["camera"])), str(whole["behavior"])
        return Checkpoint(resource, behavior, parameters, int(whole["began_us"]))
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return None
