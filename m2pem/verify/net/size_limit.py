"""How large the net of one mission may grow: some elements have very many transitions."""

import time
from dataclasses import dataclass, field

MOST_TRANSITIONS = 200_000
"""Larger nets are not searched within any useful time."""
MOST_CASES = 500_000
"""Combinations of values and of truths that a translation goes through."""


class TooLargeError(Exception):
    """A mission's net is too large to build.

    `element`: the element that was being translated; `late`: the limit of time was reached.
    """

    def __init__(self, element: str, why: str, *, late: bool = False) -> None:
        super().__init__(f"{why}, while spelling out {element}")
        self.element = element
        self.late = late


@dataclass(slots=True)
class SizeLimit:
    """Counts what a translation builds. `until_s`: deadline by `time.monotonic`; None:
    no deadline.
    """

    until_s: float | None = None
    most_transitions: int = MOST_TRANSITIONS
    transitions: int = field(default=0, init=False)
    cases: int = field(default=0, init=False)

    def count_transition(self, element: str) -> None:
        """Count a transition of an element.

        Raises:
            TooLargeError: that is too many, or it takes too long.
        """
        self.transitions += 1
        if self.transitions > self.most_transitions:
            raise TooLargeError(element, f"more than {self.most_transitions:,} transitions")
        self.check_time(element)

    def count_case(self, element: str) -> None:
        """Count a combination of what an element reads or writes.

        Raises:
            TooLargeError: that is too many, or it takes too long.
        """
        self.cases += 1
        if self.cases > MOST_CASES:
            raise TooLargeError(element, f"more than {MOST_CASES:,} combinations of its data")
        self.check_time(element)

    def check_time(self, element: str) -> None:
        """Raises TooLargeError if the deadline is over."""
        if self.until_s is not None and time.monotonic() > self.until_s:
            raise TooLargeError(element, "the limit of time", late=True)
