"""The monitor of one requirement in one run."""

from collections.abc import Sequence
from functools import lru_cache

from m2pem.mission.mission import Mission
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


@lru_cache(maxsize=20)
def english_of(mission: Mission) -> English:
    """Writes formulas with the names of a mission's elements."""
    return English({each.id: each.name for each in (*mission.nodes, *mission.processes)})


class MonitorPlan:
    """What all monitors of one formula have in common, whatever the run. `known`: the propositions
    of the letters of runs, by bit; `mask`: the bits of those that the formula is about."""

    def __init__(self, formula: Formula, known: Sequence[Proposition]) -> None:
        self.formula = formula
        self.is_timed = any(isinstance(each, Timed) for each in propositions(formula))
        base = base_propositions(formula)
        self.bits = [(1 << known.index(each), 1 << n, each) for n, each in enumerate(base)]
        self.mask = sum(bit for bit, _, _ in self.bits)
        self._letters: dict[int, int] = {}

    def letter(self, letter: int) -> int:
        """The letter of the formula, given that of the run."""
        masked = letter & self.mask
        own = self._letters.get(masked)
        if own is None:
            own = sum(mine for theirs, mine, _ in self.bits if masked & theirs)
            self._letters[masked] = own
        return own


@lru_cache(maxsize=100)
def plans(
    formulas: tuple[str, ...], before: tuple[Proposition, ...] = ()
) -> tuple[tuple[Proposition, ...], tuple[MonitorPlan, ...]]:
    """The propositions that formulas are about, each once, and the plans of their monitors.

    `before`: those of other formulas, which keep their bits.
    """
    parsed = [parse(each) for each in formulas]
    theirs = (each for part in parsed for each in base_propositions(part))
    known = tuple(dict.fromkeys((*before, *theirs)))
    return known, tuple(MonitorPlan(each, known) for each in parsed)


class Monitor:
    """Evaluates a requirement as moments and time come."""

    def __init__(self, requirement: str, plan: MonitorPlan) -> None:
        self.id = requirement
        self.mask = plan.mask
        self.is_timed = plan.is_timed
        self.verdict = Verdict.OPEN
        self.evaluation: UntimedEvaluation | TimedEvaluation = (
            TimedEvaluation(plan.formula) if plan.is_timed else UntimedEvaluation(plan.formula)
        )
        self._plan = plan

    def read(self, t_us: int, letter: int, unknown: int) -> Verdict:
        """Read the letter of a moment of the run."""
        own = self._plan.letter
        return self.evaluation.read(t_us, own(letter), own(unknown) if unknown else 0)

    def changes(self, before: int, letter: int, english: English) -> str:
        """What became true or false from one letter of the run to the next, in words."""
        return ", ".join(
            english.of(each if letter & theirs else negated(each))
            for theirs, _, each in self._plan.bits
            if (before ^ letter) & theirs
        )
