"""What a check says: a verdict for each property, and how each violation comes about."""

from dataclasses import dataclass
from enum import StrEnum


class Verdict(StrEnum):
    """Three-valued: a search that was cut short has seen no violation, and proved nothing."""

    HOLDS = "holds"
    VIOLATED = "violated"
    UNDECIDED = "undecided"


@dataclass(frozen=True, slots=True)
class Violation:
    """One way in which a property does not hold.

    `elements`: where it shows (ids), the stuck or doubled ones first. `run`: the rules that lead
    there, by number in the system that was searched; `cycle`: those that then go on for ever.
    """

    message: str
    elements: tuple[str, ...] = ()
    run: tuple[int, ...] = ()
    cycle: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Result:
    """The verdict on one property, or on one requirement of the mission's author (`required`).

    `property`: its name, or the requirement's id. `text`: what it says. `warning`: a violation of
    it is a warning, unless strict. `author`: what the author says that a requirement is for.
    """

    property: str
    text: str
    verdict: Verdict
    violations: tuple[Violation, ...] = ()
    warning: bool = False
    covered: str = ""
    """Of an undecided one: what was looked at, or what stands in the way. Of one that holds: in
    what sense, if there is more to say."""
    required: bool = False
    author: str = ""
