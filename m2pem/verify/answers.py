"""What verification says of a mission: an answer a property, with the runs that violate it."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from m2pem.verify.results import Result, Verdict


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

    answers: Sequence[Result]
    coverage: Coverage
    unreached: frozenset[str] = field(default_factory=frozenset)

    def exit_status(self, *, strict: bool = False) -> int:
        """0 holds, 1 violated, 3 undecided; `strict` makes violations of warnings."""
        counted = [each for each in self.answers if strict or not each.warning]
        if any(each.verdict is Verdict.VIOLATED for each in counted):
            return 1
        return 3 if any(each.verdict is Verdict.UNDECIDED for each in counted) else 0
