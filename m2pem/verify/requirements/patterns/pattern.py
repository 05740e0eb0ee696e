"""Patterns: requirements with a name and arguments. A pattern gives its formula and its English
text.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Protocol, TypeAlias

from m2pem.verify.ltl.formula import Always, Eventually, Formula, Timed, Until, show_us


class Kind(StrEnum):
    """The type of an argument."""

    CONDITION = "condition"
    """A formula, or the id of an element, which means `completed(id)`."""
    CONDITIONS = "conditions"
    """A list of at least two."""
    ELEMENT = "element"
    ELEMENTS = "elements"
    RESOURCE = "resource"
    """A vehicle, payload or team, or `each`: the requirement is made for each vehicle."""
    BEHAVIOR = "behavior"
    COUNT = "count"
    FLAG = "flag"
    DECISION = "decision"
    """A decision that an operator can take."""
    DURATION = "duration"
    """A time with its unit; whole microseconds when it is read."""


@dataclass(frozen=True, slots=True)
class Argument:
    """One argument. `default` None, and not required: it may be absent."""

    name: str
    kind: Kind
    required: bool = True
    default: int | bool | None = None


class Surroundings(Protocol):
    """The mission and fleet, as patterns query them."""

    def places_of(self, resource: str, behavior: str) -> Mapping[str, Sequence[str]]:
        """The tasks in which a resource does a behavior, by location."""

    def store_of(self, task: str) -> str:
        """The name to which a user task's decision is written."""


class Words(Protocol):
    """The English texts of the parts of a pattern."""

    def of(self, formula: Formula) -> str:
        """A condition as a clause: "'Drive route' is completed"."""

    def each(self, formulas: Sequence[Formula], word: str = "and") -> str:
        """Several, one after the other."""

    def element(self, element: str) -> str:
        """The name of an element."""


Arguments: TypeAlias = Mapping[str, Any]
"""Arguments by name: formulas, texts, numbers or flags, according to `Kind`; absent
ones are None.
"""


@dataclass(frozen=True, slots=True)
class Pattern:
    """A pattern. `meaning` is for the docs; `fair`: only fair runs count unless the author says
    otherwise.

    `scoped`: it may be required of a part of the run only (`scopes.py`).
    """

    name: str
    meaning: str
    arguments: tuple[Argument, ...]
    build: Callable[[Arguments, Surroundings], Formula]
    say: Callable[[Arguments, Words], str]
    scoped: bool = True
    fair: bool = False
    steps: bool = False
    """Its formula observes single steps of the run."""

    def argument(self, name: str) -> Argument | None:
        """The argument of that name."""
        return next((each for each in self.arguments if each.name == name), None)


CONDITIONS = Argument("locations", Kind.CONDITIONS)
AVOIDED = Argument("avoid", Kind.CONDITION)
WHEN, THEN = Argument("when", Kind.CONDITION), Argument("then", Kind.CONDITION)
TIMES = Argument("times", Kind.COUNT)
WITHIN = Argument("within", Kind.DURATION, required=False)
"""What is to come comes in that time at the latest."""
FOR = Argument("for", Kind.DURATION, required=False)
"""A condition counts that goes on for that time."""


def soon(a: Arguments, formula: Formula) -> Formula:
    """Now or later, and within the time that the author says."""
    later = Eventually(formula)
    return later if a["within"] is None else Timed(later, 0, a["within"])


def lasting(a: Arguments, formula: Formula) -> Formula:
    """The condition, for the time that the author says."""
    return formula if a["for"] is None else Timed(Always(formula), 0, a["for"])


def bounded(a: Arguments, until: Until) -> Formula:
    """`until`, within the time that the author says."""
    return until if a["within"] is None else Timed(until, 0, a["within"])


def say_soon(a: Arguments, otherwise: str) -> str:
    """When it comes."""
    return otherwise if a["within"] is None else f"within {show_us(a['within'])}"


def say_coming(a: Arguments) -> str:
    """That it comes, and when."""
    return "which comes" if a["within"] is None else f"which comes within {show_us(a['within'])}"


def say_lasting(a: Arguments, words: Words, formula: Formula) -> str:
    """The condition, for the time that the author says."""
    said = words.of(formula)
    return said if a["for"] is None else f"({words.of(lasting(a, formula))})"
