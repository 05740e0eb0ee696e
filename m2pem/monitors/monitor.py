"""The monitor of one requirement in one run."""

from collections.abc import Sequence

from m2pem.engine.records import RequirementMonitored
from m2pem.monitors.anticipation import Verdict, anticipation
from m2pem.monitors.timed import TimedEvaluation, base_propositions
from m2pem.verify.ltl import negated, parse
from m2pem.verify.ltl.formula import Formula, Proposition, Timed, propositions
from m2pem.verify.requirements.english import English


class UntimedEvaluation:
    """What is certain of a formula without bounds. Letters are those of its propositions."""

    due_us = None

    def __init__(self, formula: Formula) -> None:
        self._anticipation = anticipation(formula)
        self.base = self._anticipation.propositions
        self._state = self._anticipation.start
        self._last = (0, 0)

    def read(self, t_us: int, letter: int, unknown: int) -> Verdict:
        """A moment begins."""
        self._last = letter, unknown
        self._state = self._anticipation.step(self._state, letter, unknown)
        return self._anticipation.verdicts[self._state]

    def advance(self, t_us: int) -> Verdict:
        """Time has passed, which changes nothing."""
        return self._anticipation.verdicts[self._state]

    def end(self) -> Verdict:
        """The last moment remains for ever."""
        return self._anticipation.at_end(self._state, *self._last)


class Monitor:
    """Evaluates a requirement as moments and time come. `known`: the propositions of the run's
    letters, by bit; `mask`: the bits of those that the requirement is about."""

    def __init__(
        self, monitored: RequirementMonitored, known: Sequence[Proposition], english: English
    ) -> None:
        formula = parse(monitored.formula)
        timed = any(isinstance(each, Timed) for each in propositions(formula))
        self.id = monitored.requirement
        self.verdict = Verdict.OPEN
        self.is_timed = timed
        self.evaluation = (TimedEvaluation if timed else UntimedEvaluation)(formula)
        self._bits = [
            (1 << known.index(each), 1 << n, each) for n, each in enumerate(self.evaluation.base)
        ]
        self.mask = sum(bit for bit, _, _ in self._bits)
        self._english = english
        self._letters: dict[int, int] = {}

    def _own(self, letter: int) -> int:
        """The letter of the formula, given that of the run."""
        masked = letter & self.mask
        own = self._letters.get(masked)
        if own is None:
            own = sum(mine for theirs, mine, _ in self._bits if masked & theirs)
            self._letters[masked] = own
        return own

    def read(self, t_us: int, letter: int, unknown: int) -> Verdict:
        """Read the letter of a moment of the run."""
        return self.evaluation.read(t_us, self._own(letter), self._own(unknown) if unknown else 0)

    def changes(self, before: int, letter: int) -> str:
        """What became true or false from one letter of the run to the next, in words."""
        return ", ".join(
            self._english.of(each if letter & theirs else negated(each))
            for theirs, _, each in self._bits
            if (before ^ letter) & theirs
        )


def propositions_of(monitored: Sequence[RequirementMonitored]) -> tuple[Proposition, ...]:
    """All propositions that requirements are about, each once."""
    formulas = [parse(each.formula) for each in monitored]
    return tuple(dict.fromkeys(each for part in formulas for each in base_propositions(part)))
