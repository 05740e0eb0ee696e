"""Checkpoints of behaviors: what is stored to find a behavior on its vehicle after a restart.

A checkpoint is a short JSON text, the `native_ref` of reports. It has the resources, the behavior
and its parameters, without areas and long routes. The ids of goals and runs are derived from the
ids of behaviors, and are the same after a restart.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from uuid import UUID, uuid5

from m2pem.api import (
    BehaviorId,
    ResolvedValue,
    ResourceId,
    decode_parameters,
    encode_parameters,
)

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
    whole = {
        "v": _VERSION,
        "resources": list(checkpoint.resources),
        "behavior": checkpoint.behavior,
        "epoch": checkpoint.epoch,
        "parameters": encode_parameters(checkpoint.parameters, LONGEST_ROUTE),
    }
    return json.dumps(whole, separators=(",", ":"))


def decode_checkpoint(text: str) -> Checkpoint | None:
    """Return the checkpoint; None if the text was not made by `encode_checkpoint`."""
    try:
        whole = json.loads(text)
        if whole["v"] != _VERSION:
            return None
        resources = tuple(ResourceId(str(resource)) for resource in whole["resources"])
        parameters = decode_parameters(whole["parameters"])
        return Checkpoint(resources, str(whole["behavior"]), int(whole["epoch"]), parameters)
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return None


def goal_id(journal: UUID, behavior: BehaviorId) -> UUID:
    """Return the goal of a behavior: the same after a restart, and different for each journal."""
    return uuid5(journal, behavior)


def run_id(journal: UUID, behavior: BehaviorId) -> UUID:
    """Return the run of a behavior: "r1.b3" belongs to run "r1"."""
    return uuid5(journal, behavior.partition(".")[0])
