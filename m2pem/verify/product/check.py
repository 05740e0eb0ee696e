"""The search: grow the product of the system and the formula's negation, and look for rounds.

Nodes are found nearest first, so what is broken once and for all is found by a shortest run. For
what is broken only by going round for ever, the rounds are looked for each time the product has
grown fourfold, and when it is whole.
"""

import time
from collections.abc import Callable, Mapping

from m2pem.errors import InternalError
from m2pem.verify.ltl import Formula, Observer, negated
from m2pem.verify.ltl.formula import needs_steps
from m2pem.verify.product.cycles import Fairness, accepting_rounds
from m2pem.verify.product.graph import Product
from m2pem.verify.product.labelled import LabelledSystem
from m2pem.verify.product.replay import breaks
from m2pem.verify.product.verdict import Limits, Progress, Result, Run, Stopped, Verdict
from m2pem.verify.product.witness import run_round, run_to

_LOOK_EVERY = 512
"""Nodes between two looks at the clock."""
_FIRST_LOOK = 2_000
"""Nodes after which rounds are looked for the first time."""
_MOST_ROUNDS = 50
"""Of how many rounds the shortest is chosen."""


def check(
    system: LabelledSystem,
    formula: Formula,
    *,
    fair: Mapping[int, int] | None = None,
    limits: Limits | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Verdict:
    """Whether a formula holds of all runs of a system.

    `fair`: by rule, the outcome it stands for; only runs count in which each outcome that can come
    again and again does come again and again. None: all runs count.

    KeyboardInterrupt ends the search undecided.

    Raises:
        ValueError: the system leaves rules out, and the formula or the fairness needs all.
        FormulaTooLargeError: the formula's automaton would be too large.
    """
    steps = needs_steps(formula)
    if system.reduced and (steps or fair is not None):
        raise ValueError("single steps, and fairness, need a system that leaves no rule out")
    observer = Observer(negated(formula), system.propositions)
    began = time.monotonic()
    product = Product(system, observer, steps=steps)
    search = _Search(product, Fairness(product, None if fair is None else dict(fair)), began)
    try:
        run, stopped = search.run(limits or Limits(), progress)
    except KeyboardInterrupt:
        run, stopped = None, Stopped.INTERRUPTED
    if run is not None and not breaks(system, formula, run, steps=steps):
        raise InternalError("the search found a run that does not break the formula")
    if run is not None and stopped is Stopped.SYSTEM:
        stopped = None
    result = Result.VIOLATED if run is not None else Result.UNDECIDED if stopped else Result.HOLDS
    seconds = time.monotonic() - began
    return Verdict(result, run, len(product), product.number_of_moves, seconds, stopped)


class _Search:
    def __init__(self, product: Product, fairness: Fairness, began: float) -> None:
        self.product = product
        self.fairness = fairness
        self.began = began

    def run(
        self, limits: Limits, progress: Callable[[Progress], None] | None
    ) -> tuple[Run | None, Stopped | None]:
        product = self.product
        look_at = _FIRST_LOOK
        while len(product.moves) < len(product):
            if product.broken >= 0:
                return run_to(product, product.broken), None
            done = len(product.moves)
            if done % _LOOK_EVERY == 0:
                seconds = time.monotonic() - self.began
                if progress is not None:
                    progress(Progress(len(product), len(product) - done, seconds))
                stopped = self._beyond(limits, seconds)
                if stopped is not None:
                    return self._round(), stopped
            if done >= look_at:
                look_at *= 4
                if (run := self._round()) is not None:
                    return run, None
            product.expand()
        if product.broken >= 0:
            return run_to(product, product.broken), None
        return self._round(), Stopped.SYSTEM if product.open else None

    def _beyond(self, limits: Limits, seconds: float) -> Stopped | None:
        if len(self.product) > limits.states:
            return Stopped.STATES
        if seconds > limits.seconds:
            return Stopped.TIME
        return Stopped.MEMORY if self.product.bytes > limits.memory_mb * 1e6 else None

    def _round(self) -> Run | None:
        best: Run | None = None
        for found, round_ in enumerate(accepting_rounds(self.product, self.fairness)):
            run = run_round(round_, self.fairness)
            if best is None or run.length < best.length:
                best = run
            if found == _MOST_ROUNDS:
                break
        return best
