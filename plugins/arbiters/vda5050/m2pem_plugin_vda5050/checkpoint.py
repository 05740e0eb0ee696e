"""Checkpoints of behaviors: what is stored to find a behavior on its vehicle after a restart.

A checkpoint is a short JSON text, the `native_ref` of reports. The ids of orders and actions are
derived from the ids of behaviors, and are the same after a restart.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from uuid import UUID, uuid5

from m2pem.api import (
    BehaviorId,
    ResolvedValue,
    ResourceId,
    Route,
    decode_parameters,
    encode_parameters,
)

LONGEST_ROUTE = 300
"""In waypoints. Longer routes are left out, as every report carries the text."""

_VERSION = 1


@dataclass(frozen=True, slots=True)
class Checkpoint:
    """`order_before`: the order that the vehicle had before; "" if it had none, or it is not
    known. `left_out`: the number of waypoints of a route that was too long to be stored; 0: none
    was."""

    resource: ResourceId
    behavior: str
    parameters: Mapping[str, ResolvedValue]
    order_before: str = ""
    left_out: int = 0


def encode_checkpoint(checkpoint: Checkpoint) -> str:
    route = checkpoint.parameters.get("route")
    count = len(route.waypoints) if isinstance(route, Route) else 0
    whole: dict[str, Any] = {
        "v": _VERSION,
        "resource": checkpoint.resource,
        "behavior": checkpoint.behavior,
        "parameters": encode_parameters(checkpoint.parameters, LONGEST_ROUTE),
        "before": checkpoint.order_before,
    }
    if count > LONGEST_ROUTE:
        whole["left_out"] = count
    return json.dumps(whole, separators=(",", ":"))


def decode_checkpoint(text: str) -> Checkpoint | None:
    """Return the checkpoint; None if the text was not made by `encode_checkpoint`."""
    try:
        whole = json.loads(text)
        if whole["v"] != _VERSION:
            return None
        return Checkpoint(
            ResourceId(str(whole["resource"])),
            str(whole["behavior"]),
            decode_parameters(whole["parameters"]),
            str(whole["before"]),
            int(whole.get("left_out", 0)),
        )
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return None


def order_id(journal: UUID, behavior: BehaviorId) -> str:
    """Return the order, or the action, of a behavior: the same after a restart, and different for
    each journal."""
    return str(uuid5(journal, behavior))
