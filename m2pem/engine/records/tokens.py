"""Records about scopes and tokens."""

from m2pem.engine.records.base import BaseRecord, TokenOutcome
from m2pem.mission.values import Value


class ScopeOpened(BaseRecord, frozen=True):
    """An instance of a container has begun. `token` is on its activity in scope `parent`.

    `instances`: the scope holds the instances of a loop or multi-instance activity; their number,
    -1 if not known (a standard loop). `items`: the collection that they come from; the nth instance
    has the nth item. `message`: it begins with the first of the kept messages of that id.
    """

    scope: int
    process: str
    element: str
    parent: int | None = None
    token: int | None = None
    instances: int | None = None
    items: tuple[Value, ...] | None = None
    message: str = ""


class ScopeClosed(BaseRecord, frozen=True):
    """An instance of a container has ended and its data is gone.

    `kept`: it and its data are kept, because something that was done in it can be compensated.
    """

    scope: int
    process: str
    element: str
    outcome: TokenOutcome
    kept: bool = False


class TokenEntered(BaseRecord, frozen=True):
    """A token has entered an element. `flow`: the sequence flow that it came by.

    `instance`: which instance of a loop or multi-instance activity it is, from 0; absent: none.
    """

    token: int
    process: str
    element: str
    scope: int
    flow: str = ""
    instance: int | None = None


class TokenLeft(BaseRecord, frozen=True):
    """A token has left an element. Without a later `TokenEntered` it was consumed."""

    token: int
    process: str
    element: str
    scope: int
    outcome: TokenOutcome
    instance: int | None = None


class InstanceOutput(BaseRecord, frozen=True):
    """The output of an instance of a multi-instance activity, for the output collection."""

    token: int
    process: str
    element: str
    scope: int
    instance: int
    value: Value


class FlowTaken(BaseRecord, frozen=True):
    """A token takes a sequence flow; `element` is its source. `reason`: which conditions of other
    flows were null when it was decided, and why."""

    token: int
    process: str
    element: str
    scope: int
    flow: str
    reason: str = ""


class ScopeInterrupted(BaseRecord, frozen=True):
    """An event subprocess (`element`) has ended all else in the scope; no other can begin."""

    scope: int
    process: str
    element: str


class ScopeCompleting(BaseRecord, frozen=True):
    """Only event subprocesses are still active in the scope: no other one can begin."""

    scope: int
    process: str
    element: str


class ActivitiesChosen(BaseRecord, frozen=True):
    """The expression of an ad-hoc subprocess has chosen its activities, in this order."""

    token: int
    process: str
    element: str
    scope: int
    elements: tuple[str, ...]


class TokensGathered(BaseRecord, frozen=True):
    """Enough tokens have arrived at an activity (`startQuantity`); `token` begins it."""

    token: int
    process: str
    element: str
    scope: int


class GatewayActivated(BaseRecord, frozen=True):
    """A complex gateway has used the tokens of `flows`, and waits for the others to reset."""

    process: str
    element: str
    scope: int
    flows: tuple[str, ...]


class GatewayReset(BaseRecord, frozen=True):
    """A complex gateway can be activated again."""

    process: str
    element: str
    scope: int
