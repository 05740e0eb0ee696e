"""The whole of a run's state in a form that compares: what replay and re-deciding must rebuild."""

from dataclasses import fields, is_dataclass
from typing import Any

from m2pem.engine.state import (
    AllocationRequest,
    Behavior,
    Breakpoints,
    Compensation,
    CompletedActivity,
    DataStores,
    Incident,
    Join,
    Keeping,
    KeptMessage,
    Loop,
    LostWork,
    OutOfReach,
    Prompt,
    RunState,
    Scope,
    Service,
    Token,
    Wait,
)
from m2pem.mission.elements import Element
from m2pem.mission.losses import Loss
from m2pem.mission.mission import Mission

_OBJECTS = (
    Scope,
    Token,
    Wait,
    AllocationRequest,
    Behavior,
    Prompt,
    Incident,
    Service,
    Keeping,
    CompletedActivity,
    Compensation,
)


def snapshot(state: RunState) -> dict[str, Any]:
    """Every field of the state and of all that it holds, in order; references are ids."""
    whole = {each.name: _plain(getattr(state, each.name)) for each in fields(state)}
    held: list[object] = [state.root] if state.root is not None else []
    for kept in (state.scopes, state.tokens, state.waits, state.behaviors):
        held.extend(kept.values())
    objects = (state.allocations, state.prompts, state.services, state.incidents, state.kept)
    for also in objects:
        held.extend(also.values())
    for each in held:
        if isinstance(each, Scope):  # grows while it is walked
            held.extend((each.compensable or {}).values())
            held.extend((each.compensations or {}).values())
        elif isinstance(each, CompletedActivity) and each.kept_scope is not None:
            held.append(each.kept_scope)
    whole["objects"] = [
        (type(each).__name__, {f.name: _plain(getattr(each, f.name)) for f in fields(each)})  # type: ignore[arg-type]
        for each in held
    ]
    return whole


def _plain(value: object) -> object:
    if isinstance(value, Mission):
        return value.file
    if isinstance(value, Element):
        return value.id
    if isinstance(value, _OBJECTS):
        return f"{type(value).__name__} {value.id}"
    if isinstance(value, (Breakpoints, KeptMessage, Loop, Loss, LostWork, OutOfReach, DataStores)):
        return [(each.name, _plain(getattr(value, each.name))) for each in fields(value)]
    if isinstance(value, Join):
        return _plain(value.by_flow)
    if isinstance(value, dict):
        return [(_plain(key), _plain(item)) for key, item in value.items()]
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    assert not is_dataclass(value), f"{type(value).__name__} has no plain form"
    return value
