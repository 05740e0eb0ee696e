"""Linear temporal logic: what requirements of missions are written in, and automata for it.

    formula = parse("[](completed(Cross) -> once(completed(Approve)))")
    observer = Observer(negated(formula))       # accepts the runs that break it

A run is a sequence of *moments*. What a step completes is true in a moment of its own, which a
quiet moment in the same state follows; that is why no formula can count the steps that it does
not name happen between two that it does, and why searches may leave such steps out.
"""

from m2pem.verify.ltl.formula import Formula, Proposition, negated, propositions, show
from m2pem.verify.ltl.observer import Observer
from m2pem.verify.ltl.parser import parse

__all__ = ["Formula", "Observer", "Proposition", "negated", "parse", "propositions", "show"]
