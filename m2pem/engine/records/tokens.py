"""Records about scopes and tokens: the game itself."""

from m2pem.engine.records.base import BaseRecord, TokenOutcome
from m2pem.mission.values import Value


class ScopeOpened(BaseRecord, frozen=True):
    """An instance of a container has begun. `token` sits on its activity in scope `parent`.

    `instances`: the scope is that of the instances of a loop or multi-instance activity; how many
    there will be, -1 when nobody knows (a standard loop). `items`: what they come from, if from a
    collection; the nth instance has the nth.
    """

    scope: int
    process: str
    element: str
    parent: int | None = None
    token: int | None = None
    instances: int | None = None
    items: tuple[Value, ...] | None = None


class ScopeClosed(BaseRecord, frozen=True):
    """The instance has ended and its data is gone.

    `kept`: it and its data are kept, because something that was done in it can be undone.
    """

    scope: int
    process: str
    element: str
    outcome: TokenOutcome
    kept: bool = False


class TokenEntered(BaseRecord, frozen=True):
    """A token is on an element. `flow`: the sequence flow that it came by.

    `instance`: which instance of a loop or multi-instance activity it is, from 0; absent: none.
    """

    token: int
    process: str
    element: str
    scope: int
    flow: str = ""
    instance: int | None = None


class TokenLeft(BaseRecord, frozen=True):
    """It is there no more. Without a later `TokenEntered` it was consumed. `instance` likewise."""

    token: int
    process: str
    element: str
    scope: int
    outcome: TokenOutcome
    instance: int | None = None


class InstanceOutput(BaseRecord, frozen=True):
    """What an instance of a multi-instance activity has given, to be collected."""

    token: int
    process: str
    element: str
    scope: int
    instance: int
    value: Value


class FlowTaken(BaseRecord, frozen=True):
    """`element` is where the flow begins."""

    token: int
    process: str
    element: str
    scope: int
    flow: str


class ScopeInterrupted(BaseRecord, frozen=True):
    """An event subprocess (`element`) has ended all else in the scope; no other can begin."""

    scope: int
    process: str
    element: str


class ScopeCompleting(BaseRecord, frozen=True):
    """Only event subprocesses are active in the scope any more: no other one can begin."""

    scope: int
    process: str
    element: str


class ActivitiesChosen(BaseRecord, frozen=True):
    """An ad-hoc subprocess has begun whose own expression chooses what is done in it, in order."""

    token: int
    process: str
    element: str
    scope: int
    elements: tuple[str, ...]


class TokensGathered(BaseRecord, frozen=True):
    """As many tokens have come to an activity as begin it; `token` does so, the others left."""

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
