"""What a system must tell for a formula to be checked of it."""

from collections.abc import Sequence
from typing import Protocol

from m2pem.verify.ltl.formula import Proposition

STUTTER = -1
"""In place of a rule: the run is over, and its last state stays for ever."""
QUIET = -2
"""In place of a rule: the quiet moment after one in which something was completed."""


class LabelledSystem(Protocol):
    """States and rules are numbers; what is true is a bit for each of `propositions`.

    A proposition of states (`active`, `commanded`, `ended`, data) is true as long as the state is
    one in which it is. One of rules (`completed`) is true in the moment in which the rule fires.

    A state without successors is the end of a run. A system that leaves out rules whose order
    makes no difference must keep all runs apart that differ in what is true of their states and
    rules, and says so (`reduced`).
    """

    @property
    def propositions(self) -> Sequence[Proposition]:
        """What the bits stand for."""
        ...

    @property
    def reduced(self) -> bool:
        """Whether successors are left out: not every rule that can fire is among them."""
        ...

    def initial(self) -> Sequence[int]:
        """The states in which runs begin."""
        ...

    def is_open(self, state: int) -> bool:
        """Whether what follows a state is not known: runs may go on, but not where to."""
        ...

    def successors(self, state: int) -> Sequence[tuple[int, int]]:
        """The rules that can fire in a state, each with the state after it."""
        ...

    def true_in(self, state: int) -> int:
        """The propositions that are true in a state."""
        ...

    def true_when(self, rule: int) -> int:
        """The propositions that are true in the moment in which a rule fires."""
        ...
