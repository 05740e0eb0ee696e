"""Bounds how many requests of a kind are handled at once."""

from collections.abc import Iterator
from contextlib import contextmanager

from m2pem.errors import OperatorError


class Gate:
    """Who comes when it is full is refused at once, so that nothing piles up behind what hangs."""

    def __init__(self, at_once: int) -> None:
        self._at_once = at_once
        self.inside = 0
        self.refused = 0

    @contextmanager
    def passed(self) -> Iterator[None]:
        """Be counted within the block.

        Raises:
            OperatorError: too many are inside.
        """
        if self.inside >= self._at_once:
            self.refused += 1
            raise OperatorError(
                f"{self.inside} requests of this kind are being handled, and more are not taken "
                "at once: wait for their answers, then ask again"
            )
        self.inside += 1
        try:
            yield
        finally:
            self.inside -= 1
