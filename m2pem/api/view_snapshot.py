"""A view of a run as bytes, from which it goes on: a long run is replayed from the nearest one.

The bytes are MessagePack, for the program that wrote them: another version of m2pem may have other
fields, and then a view is made from the run's records again.
"""

from collections.abc import Mapping
from operator import attrgetter
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
    """A view: its attributes of these names. The last four have another form there."""

    summary: RunSummary
    seq: int
    t_s: float
    paused_by: str
    breakpoints: r.BreakpointsSet | None
    reached: r.BreakpointReached | None
    stepping: bool
    _paused_us: int
    _paused_at_us: int
    elements: dict[Place, ElementState]
    scopes: dict[int, Scope]
    behaviors: dict[str, Behavior]
    allocations: dict[str, Allocation]
    services: dict[str, Service]
    prompts: dict[str, r.PromptOpened]
    incidents: dict[str, r.IncidentOpened]
    waits: dict[int, Wait]
    kept: dict[str, r.ResourceKept]
    holders: dict[str, str]
    _ended_behaviors: dict[str, Behavior]
    _ended_allocations: dict[str, Allocation]
    _closed_prompts: dict[str, r.PromptOpened]
    _past_waits: dict[int, Wait]
    version: str
    tokens: list[_Token]
    finished: list[FinishedToken]
    completed: list[str]
    requirements: dict[str, RequirementState]


_ATTRIBUTES = _Snapshot.__struct_fields__[:-4]

_encode = msgspec.msgpack.Encoder().encode
_decoder = msgspec.msgpack.Decoder(_Snapshot)


def snapshot_of(view: RunView) -> bytes:
    """Return a view as bytes, without its mission and its newest records."""
    attributes = {name: getattr(view, name) for name in _ATTRIBUTES}
    return _encode(
        _Snapshot(
            **attributes,
            tokens=[_token_of(each) for each in view.tokens.values()],
            finished=list(view.finished),
            completed=sorted(view.completed),  # the same view has the same bytes
            requirements=view.requirements,
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
    for name in _ATTRIBUTES:
        setattr(view, name, getattr(read, name))
    view.finished.extend(read.finished)
    view.completed = set(read.completed)
    view.requirements = RequirementStates(read.requirements)
    work: dict[str, Behavior | Service | Allocation] = {
        **view.behaviors,
        **view.allocations,
        **view.services,
    }
    view.tokens = {each.id: _token_from(each, work) for each in read.tokens}
    return view


def _token_of(token: Token) -> _Token:
    return _Token(*(*_same(token), list(token.work), sorted(token.prompts), token.waits))


def _token_from(read: _Token, work: Mapping[str, Behavior | Service | Allocation]) -> Token:
    at_work = {each: work[each] for each in read.work if each in work}
    return Token(*(*_same(read), at_work, set(read.prompts), read.waits))


_same = attrgetter(*_Token.__struct_fields__[:-3])
"""What a token has in the same order and form in both."""
