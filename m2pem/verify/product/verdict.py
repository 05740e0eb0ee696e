"""Answers: whether a formula holds, or how it is broken, or how far the search came."""

from dataclasses import dataclass
from enum import StrEnum


@dataclass(frozen=True, slots=True)
class Limits:
    """Where a search stops undecided. `states`: pairs of the system's and the formula's."""

    states: int = 2_000_000
    seconds: float = 600.0
    memory_mb: float = 2_000.0


class Stopped(StrEnum):
    """Why a search did not see all."""

    STATES = "the limit of states"
    TIME = "the limit of time"
    MEMORY = "the limit of memory"
    SYSTEM = "states beyond which the mission was not searched"
    INTERRUPTED = "an interruption by hand"


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a search is: pairs of states found, those still to look at, seconds so far."""

    states: int
    waiting: int
    seconds: float


class Result(StrEnum):
    """What is known of a formula."""

    HOLDS = "holds"
    VIOLATED = "violated"
    UNDECIDED = "undecided"


@dataclass(frozen=True, slots=True)
class Move:
    """A rule fires, and leads to a state."""

    rule: int
    state: int


@dataclass(frozen=True, slots=True)
class Run:
    """A run from `start`: the moves of `prefix`, then those of `cycle` again and again.

    Without a cycle the run is over after the prefix; or, where `whatever_follows`, the formula is
    broken by then, and nothing that comes later can mend it.
    """

    start: int
    prefix: tuple[Move, ...]
    cycle: tuple[Move, ...] = ()
    whatever_follows: bool = False

    @property
    def length(self) -> int:
        """How many moves are told."""
        return len(self.prefix) + len(self.cycle)


@dataclass(frozen=True, slots=True)
class Verdict:
    """The answer of a search, with what it cost. `run` breaks the formula; only if violated."""

    result: Result
    run: Run | None
    states: int
    moves: int
    seconds: float
    stopped: Stopped | None = None
