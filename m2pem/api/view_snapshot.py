"""A view of a run as bytes, from which it goes on: a long run is replayed from the nearest one.

The bytes are MessagePack, for the program that wrote them: another version of m2pem may have other
fields, and then a view is made from the run's records again.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import msgspec

from m2pem.api import records as r
from m2pem.api.requirement_states import RequirementState, RequirementStates
from m2pem.api.run_view import (
    Allocation,
    Behavior,
    ElementState,
    FinishedToken,
    Place,
    RunView,
    Scope,
    Service,
    Token,
    Wait,
)
from m2pem.api.runs import RunSummary

if TYPE_CHECKING:
    from m2pem.mission.mission import Mission


class _Token(msgspec.Struct, array_like=True):
    """A token. Its behaviors, services and allocations are named: the view has each once."""

    id: int
    process: str
    element: str
    scope: int
    seq: int
    since_us: int
    instance: int | None
    is_around: bool
    work: list[str]
    prompts: list[str]
    waits: dict[int, Wait]


class _Snapshot(msgspec.Struct, array_like=True):
    summary: RunSummary
    seq: int
    t_s: float
    paused_by: str
    breakpoints: r.BreakpointsSet | None
    reached: r.BreakpointReached | None
    stepping: bool
    paused_us: int
    paused_at_us: int
    elements: list[tuple[Place, ElementState]]
    scopes: dict[int, Scope]
    tokens: list[_Token]
    finished: list[FinishedToken]
    completed: list[str]
    behaviors: list[Behavior]
    allocations: list[Allocation]
    services: list[Service]
    prompts: list[r.PromptOpened]
    incidents: list[r.IncidentOpened]
    waits: dict[int, Wait]
    kept: list[r.ResourceKept]
    holders: dict[str, str]
    ended_behaviors: list[Behavior]
    ended_allocations: list[Allocation]
    closed_prompts: list[r.PromptOpened]
    past_waits: list[tuple[int, Wait]]
    requirements: list[RequirementState]
    version: str


_encode = msgspec.msgpack.Encoder().encode
_decoder = msgspec.msgpack.Decoder(_Snapshot)


def snapshot_of(view: RunView) -> bytes:
    """Return a view as bytes, without its mission and its newest records."""
    return _encode(
        _Snapshot(
            view.summary,
            view.seq,
            view.t_s,
            view.paused_by,
            view.breakpoints,
            view.reached,
            view.stepping,
            view._paused_us,
            view._paused_at_us,
            list(view.elements.items()),
            view.scopes,
            [_token_of(each) for each in view.tokens.values()],
            list(view.finished),
            sorted(view.completed),
            list(view.behaviors.values()),
            list(view.allocations.values()),
            list(view.services.values()),
            list(view.prompts.values()),
            list(view.incidents.values()),
            view.waits,
            list(view.kept.values()),
            view.holders,
            list(view._ended_behaviors.values()),
            list(view._ended_allocations.values()),
            list(view._closed_prompts.values()),
            list(view._past_waits.items()),
            list(view.requirements.values()),
            view.version,
        )
    )


def view_of(
    snapshot: bytes, mission: "Mission | None" = None, names: Mapping[str, str] | None = None
) -> RunView:
    """Return the view that `snapshot_of` wrote; it goes on with the next record. `mission`,
    `names`: see `RunView`. Its `newest` has only what is applied from now on.

    Raises:
        ValueError: the bytes are damaged, or of another version of m2pem.
    """
    read = _decoder.decode(snapshot)
    view = RunView(read.summary, mission, names)
    view.seq, view.t_s = read.seq, read.t_s
    view.paused_by = read.paused_by
    view.breakpoints, view.reached = read.breakpoints, read.reached
    view.stepping = read.stepping
    view._paused_us, view._paused_at_us = read.paused_us, read.paused_at_us
    view.elements = dict(read.elements)
    view.scopes = read.scopes
    view.finished.extend(read.finished)
    view.completed = set(read.completed)
    view.behaviors = {each.id: each for each in read.behaviors}
    view.allocations = {each.id: each for each in read.allocations}
    view.services = {each.id: each for each in read.services}
    view.prompts = {each.prompt: each for each in read.prompts}
    view.incidents = {each.incident: each for each in read.incidents}
    view.waits = read.waits
    view.kept = {each.keeping: each for each in read.kept}
    view.holders = read.holders
    view._ended_behaviors = {each.id: each for each in read.ended_behaviors}
    view._ended_allocations = {each.id: each for each in read.ended_allocations}
    view._closed_prompts = {each.prompt: each for each in read.closed_prompts}
    view._past_waits = dict(read.past_waits)
    view.requirements = RequirementStates({each.id: each for each in read.requirements})
    view.version = read.version
    work: dict[str, Behavior | Service | Allocation] = {
        **view.behaviors,
        **view.allocations,
        **view.services,
    }
    view.tokens = {each.id: _token_from(each, work) for each in read.tokens}
    return view


def _token_of(token: Token) -> _Token:
    return _Token(
        token.id,
        token.process,
        token.element,
        token.scope,
        token.seq,
        token.since_us,
        token.instance,
        token.is_around,
        list(token.work),
        sorted(token.prompts),
        token.waits,
    )


def _token_from(read: _Token, work: Mapping[str, Behavior | Service | Allocation]) -> Token:
    return Token(
        read.id,
        read.process,
        read.element,
        read.scope,
        read.seq,
        read.since_us,
        read.instance,
        read.is_around,
        {each: work[each] for each in read.work if each in work},
        set(read.prompts),
        read.waits,
    )
