"""What is true in the moments of a run, and whether that breaks the formula: the answer's proof."""

from m2pem.verify.ltl.formula import Formula
from m2pem.verify.ltl.lasso import Moment, holds
from m2pem.verify.product.labelled import LabelledSystem
from m2pem.verify.product.verdict import Move, Run


def breaks(system: LabelledSystem, formula: Formula, run: Run, *, steps: bool) -> bool:
    """Whether a run is one of the system's, and the formula does not hold of it.

    A run that is broken whatever follows is tried with the run that first comes to hand.
    """
    run = _continued(system, run) if run.whatever_follows else run
    last = run.start
    for move in (*run.prefix, *run.cycle):
        if (move.rule, move.state) not in system.successors(last):
            return False
        last = move.state
    prefix = [_moment(system, run.start, None)]
    prefix += _moments(system, run.prefix, steps=steps)
    back_to = run.prefix[-1].state if run.prefix else run.start
    if run.cycle:
        if last != back_to:
            return False
        cycle = _moments(system, run.cycle, steps=steps)
    else:
        if system.successors(last):
            return False
        cycle = [_moment(system, last, None)]
    return not holds(formula, prefix, cycle)


def _continued(system: LabelledSystem, run: Run) -> Run:
    """The run with something that follows: the first rule each time, until a state comes again."""
    state = run.prefix[-1].state if run.prefix else run.start
    seen = {state: 0}
    further: list[Move] = []
    while steps := system.successors(state):
        rule, state = steps[0]
        further.append(Move(rule, state))
        if state in seen:
            at = seen[state]
            return Run(run.start, (*run.prefix, *further[:at]), tuple(further[at:]))
        seen[state] = len(further)
    return Run(run.start, (*run.prefix, *further))


def _moments(system: LabelledSystem, moves: tuple[Move, ...], *, steps: bool) -> list[Moment]:
    found: list[Moment] = []
    for move in moves:
        found.append(_moment(system, move.state, move.rule))
        if system.true_when(move.rule) and not steps:
            found.append(_moment(system, move.state, None))
    return found


def _moment(system: LabelledSystem, state: int, rule: int | None) -> Moment:
    bits = system.true_in(state) | (0 if rule is None else system.true_when(rule))
    return frozenset(each for n, each in enumerate(system.propositions) if bits >> n & 1)
