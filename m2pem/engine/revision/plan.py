"""The plan of a revision: what it does to a run, and why it cannot be."""

import hashlib
import json
from dataclasses import dataclass, field
from enum import StrEnum

from m2pem.mission.difference import Difference
from m2pem.mission.elements import Element
from m2pem.mission.values import Value


class EffectKind(StrEnum):
    """What a revision does to a token, or to what it does or waits for."""

    MOVES = "moves"
    """The work of the token's element ends, and the token goes to another element."""
    ENDS = "ends"
    """The work of the token's element ends, and the token is consumed."""
    RESTARTS = "restarts"
    """The task of the token begins again: its behavior, prompt or service is cancelled first."""
    ADJUSTS = "adjusts"
    """The behavior of the token goes on at another speed."""
    GOES_ON = "goes on"
    """A token that waited at a join waits no longer, or for others than before."""
    ARMS = "arms"
    """An event is awaited that was not."""
    REARMS = "rearms"
    """An event is awaited as the new version says."""
    DISARMS = "disarms"
    """An event is awaited no longer."""
    CHANGES = "changes"
    """The token stays on an element that is another one from now on, and its work goes on."""


@dataclass(frozen=True, slots=True)
class Effect:
    """One thing that a revision does. `token` 0: it is no token's. `text`: a sentence for people;
    ids of elements are those of the old version for tokens, of the new one for events."""

    kind: EffectKind
    element: str
    token: int
    text: str


@dataclass(frozen=True, slots=True)
class Refusal:
    """Why a revision cannot be, and the way out. `candidates`: where the token can go instead, by
    the ids of elements and sequence flows of the new version. `can_end`: it can end instead. A
    refusal of an instance is one of its activity as a whole."""

    element: str
    token: int
    text: str
    candidates: tuple[str, ...] = ()
    can_end: bool = False


@dataclass(frozen=True, slots=True)
class Move:
    """A token leaves its element. `target`: the element or sequence flow of the new version that
    it goes to; "": it ends."""

    token: int
    scope: int
    target: str


@dataclass(frozen=True, slots=True)
class Arming:
    """Events of an element of the new version that are awaited from now on. `token` 0: by the
    scope. `since_us`: the mission time from which a duration counts; None: from now."""

    token: int
    scope: int
    element: str
    since_us: int | None = None


@dataclass(frozen=True, slots=True)
class Adjustment:
    """A behavior goes on with these parameters in place of those of the same names."""

    behavior: str
    parameters: dict[str, Value]


@dataclass(frozen=True, slots=True)
class RevisionPlan:
    """What a revision does to a run in the state for which the plan was made.

    `version`, `previous`: of the files (`m2pem.mission.mission`). `requested`: where tokens were
    asked to go, by element. The last six fields are what carrying it out needs; `rechecked`:
    scopes of ad-hoc subprocesses that offer or begin other activities now.
    """

    version: str
    previous: str
    requested: dict[str, str]
    difference: Difference
    effects: tuple[Effect, ...]
    refusals: tuple[Refusal, ...]
    moves: tuple[Move, ...] = field(repr=False, default=())
    restarted: tuple[int, ...] = field(repr=False, default=())
    adjustments: tuple[Adjustment, ...] = field(repr=False, default=())
    disarmed: tuple[int, ...] = field(repr=False, default=())
    armings: tuple[Arming, ...] = field(repr=False, default=())
    rechecked: tuple[int, ...] = field(repr=False, default=())

    @property
    def digest(self) -> str:
        """What names the outcome: two plans with the same digest do the same to a run, maybe to
        other tokens on the same elements."""
        outcome = [
            self.version,
            self.previous,
            sorted(self.requested.items()),
            sorted([each.kind.value, each.element] for each in self.effects),
            sorted([each.element, each.text] for each in self.refusals),
        ]
        return hashlib.sha256(json.dumps(outcome).encode()).hexdigest()


def called(element: Element) -> str:
    """Return what to call an element in a sentence: its kind, name and id."""
    name = f"{element.label!r} ({element.id})" if element.label != element.id else element.id
    return f"{element.kind} {name}"
