"""What verification says of a mission: an answer a property, with the runs that violate it."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum


class Verdict(StrEnum):
    """What is known of a property."""

    HOLDS = "holds"
    VIOLATED = "violated"
    UNDECIDED = "undecided"


@dataclass(frozen=True, slots=True)
class Alarm:
    """One way in which a property is violated.

    `text`: what is wrong, with names. `elements`: where, by id. `run`: the rules that lead there
    (empty: it can be seen without one); with `loop`, those that can then follow again and again.
    `reason`: a code for programs, "" if the property says it all.
    """

    text: str
    elements: tuple[str, ...] = ()
    run: tuple[int, ...] = ()
    loop: tuple[int, ...] = ()
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Answer:
    """What is known of one property.

    `property`: its name for programs, such as `no_deadlock`; `says`: it in a sentence. `warning`:
    its violations are warnings, unless they are told to be errors. `note`: of one that is
    undecided, what was covered.
    """

    property: str
    says: str
    verdict: Verdict
    alarms: tuple[Alarm, ...] = ()
    warning: bool = False
    note: str = ""


@dataclass(frozen=True, slots=True)
class Coverage:
    """How much was searched. `stopped`: why not all, "" if it was all. Times are seconds."""

    states: int
    transitions: int
    seconds: float
    stopped: str = ""
    engine: str = "builtin"


@dataclass(frozen=True, slots=True)
class Answers:
    """All of it. `unreached`: elements that no run gets to."""

    answers: Sequence[Answer]
    coverage: Coverage
    unreached: frozenset[str] = field(default_factory=frozenset)

    def exit_status(self, *, strict: bool = False) -> int:
        """0 holds, 1 violated, 3 undecided; `strict` makes violations of warnings."""
        counted = [each for each in self.answers if strict or not each.warning]
        if any(each.verdict is Verdict.VIOLATED for each in counted):
            return 1
        return 3 if any(each.verdict is Verdict.UNDECIDED for each in counted) else 0
