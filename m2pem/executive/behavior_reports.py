"""An arbiter's report as an input of its run, with what it may write to the data store."""

import logging
from collections.abc import Mapping
from math import isfinite
from typing import cast

from m2pem.api.arbiter import BehaviorReport
from m2pem.engine.inputs import BehaviorReported
from m2pem.engine.state import Behavior
from m2pem.executive.fleet_connections import FleetArbiters
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import BehaviorSpec
from m2pem.mission.values import Value

log = logging.getLogger("m2pem.dispatch")


def spec_of(behavior: Behavior, arbiters: FleetArbiters) -> BehaviorSpec | None:
    """How the behavior is offered on what does it; None: it is not any more."""
    kind = BehaviorType(behavior.type)
    return arbiters.graph.spec(behavior.resources[0], behavior.name, kind)


def reported(
    report: BehaviorReport, behavior: Behavior | None, arbiters: FleetArbiters, number: int = 0
) -> BehaviorReported:
    """The input. `behavior`: what is reported on, if it is active. `number`: the least it has."""
    return BehaviorReported(
        report.id,
        max(report.number, number),
        report.state,
        report.code,
        report.reason,
        report.native_ref,
        _outputs(report, behavior, arbiters) if report.outputs and behavior is not None else {},
        _remaining(report),
        dict(report.evidence),
    )


def _remaining(report: BehaviorReport) -> dict[str, Value] | None:
    """What is left, if it can be kept; else what was reported before counts."""
    remaining = dict(report.remaining) if report.remaining is not None else None
    if not _can_be_kept(remaining):
        log.error("%s: JSON cannot say what its arbiter says is left: %r", report.id, remaining)
        return None
    return remaining


def _outputs(
    report: BehaviorReport, behavior: Behavior, arbiters: FleetArbiters
) -> dict[str, Value]:
    """Those that can be kept. Others are the arbiter's fault, and logged: what has happened on the
    vehicle must not be lost for them."""
    spec = spec_of(behavior, arbiters)
    declared = spec.writes if spec is not None else ()
    kept: dict[str, Value] = {}
    for key, value in report.outputs.items():
        if not any(key == name or key.startswith(f"{name}.") for name in declared):
            log.error("%s: its arbiter wrote %s, which its `writes` do not declare", report.id, key)
        elif not _can_be_kept(value):
            log.error("%s: its arbiter wrote %s, which JSON cannot say: %r", report.id, key, value)
        else:
            kept[key] = value
    return kept


def _can_be_kept(value: object) -> bool:
    # What is left of a route has hundreds of numbers, and is reported often.
    kind = type(value)
    if kind is float:
        return isfinite(cast("float", value))
    if kind is list:
        return all(map(_can_be_kept, cast("list[object]", value)))
    match value:
        case None | bool() | int():
            return True
        case float():
            return isfinite(value)
        case str():
            if value.isascii():
                return True
            return not any("\ud800" <= character <= "\udfff" for character in value)
        case list():
            return all(map(_can_be_kept, value))
        case Mapping():
            return all(isinstance(k, str) and _can_be_kept(v) for k, v in value.items())
    return False
