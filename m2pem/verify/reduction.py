"""Which rules need not be tried in a state, because another order leads to the same."""

from collections.abc import Callable, Sequence
from typing import Protocol

from m2pem.verify.encoding import Encoding

Choose = Callable[[int, Sequence[int]], Sequence[int]]
"""Of the rules that may fire in a state, those to try."""


class Reduction(Protocol):
    """Chooses, in each state, which of the rules that may fire are tried."""

    def bind(self, encoding: Encoding) -> Choose:
        """Get ready for one way of writing the system's states."""
        ...
