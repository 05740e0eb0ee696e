"""What is made once of a formula that runs are monitored for, and what each run has of it."""

from collections.abc import Sequence
from functools import cached_property, lru_cache

from m2pem.mission.mission import Mission
from m2pem.monitors.anticipation import Verdict, anticipation
from m2pem.monitors.moments import MomentTables
from m2pem.monitors.product import Product, own_letter
from m2pem.monitors.timed import TimedEvaluation, TimedPlan, base_propositions
from m2pem.verify.ltl import negated, parse
from m2pem.verify.ltl.formula import (
    Formula,
    Measured,
    Proposition,
    Timed,
    propositions,
    show_measured,
)
from m2pem.verify.requirements.english import English


@lru_cache(maxsize=20)
def english_of(mission: Mission) -> English:
    """Writes formulas with the names of a mission's elements."""
    return English({each.id: each.name for each in (*mission.nodes, *mission.processes)})


class MonitorPlan:
    """What all monitors of one formula have in common, whatever the run. `known`: the propositions
    of the letters of runs, by bit; `mask`: the bits of those that the formula is about.

    `timed`: for a formula with bounds; `untimed`: for one without, a part of a `Product`.
    """

    def __init__(self, formula: Formula, known: Sequence[Proposition]) -> None:
        base = base_propositions(formula)
        self._named = [(1 << known.index(each), each) for each in base]
        self.bits = tuple((1 << known.index(each), 1 << n) for n, each in enumerate(base))
        self.mask = sum(bit for bit, _ in self.bits)
        is_timed = any(isinstance(each, Timed) for each in propositions(formula))
        self.timed = TimedPlan(formula) if is_timed else None
        self.untimed = None if is_timed else (anticipation(formula), self.bits)
        self._letters: dict[int, int] = {}

    def letter(self, letter: int) -> int:
        """The letter of the formula, given that of the run."""
        masked = letter & self.mask
        own = self._letters.get(masked)
        if own is None:
            own = self._letters[masked] = own_letter(self.bits, masked)
        return own

    def changes(self, before: int, letter: int, english: English) -> str:
        """What became true or false from one letter of the run to the next, in words."""
        return ", ".join(
            english.of(each if letter & theirs else negated(each))
            for theirs, each in self._named
            if (before ^ letter) & theirs
        )


class Plans:
    """What the monitors of several formulas have in common, whatever the run. `known`: the
    propositions that they are about, each once, in the order of the bits of the run's letters.

    `before`: propositions of other formulas, which keep their bits.
    """

    def __init__(self, formulas: Sequence[str], before: Sequence[Proposition] = ()) -> None:
        parsed = [parse(each) for each in formulas]
        theirs = (each for part in parsed for each in base_propositions(part))
        self.known = tuple(dict.fromkeys((*before, *theirs)))
        self.each = tuple(MonitorPlan(formula, self.known) for formula in parsed)
        self.measured = tuple(
            (1 << number, show_measured(named), named)
            for number, named in enumerate(self.known)
            if isinstance(named, Measured)
        )
        """Bits, texts and conditions on telemetry."""

    @cached_property
    def product(self) -> Product:
        """That of the formulas without bounds, in their order."""
        return Product([plan.untimed for plan in self.each if plan.untimed is not None])


@lru_cache(maxsize=100)
def plans(formulas: tuple[str, ...]) -> Plans:
    """The plans of the formulas that runs are monitored for from their beginning, made once."""
    return Plans(formulas)


@lru_cache(maxsize=100)
def tables(made: Plans, mission: Mission) -> MomentTables:
    """What the records of a mission's runs say of the propositions, made once."""
    return MomentTables(made.known, mission)


class TimedMonitor:
    """Evaluates a formula with bounds as moments and time come."""

    def __init__(self, plan: MonitorPlan, timed: TimedPlan) -> None:
        self.mask = plan.mask
        self.evaluation = TimedEvaluation(timed)
        self._plan = plan

    def read(self, t_us: int, letter: int, unknown: int) -> Verdict:
        """Read the letter of a moment of the run."""
        own = self._plan.letter
        return self.evaluation.read(t_us, own(letter), own(unknown) if unknown else 0)
