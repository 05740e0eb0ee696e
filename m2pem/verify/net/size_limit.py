"""How much may be made of one mission: some elements stand for very many rules."""

import time
from dataclasses import dataclass, field

MOST_RULES = 200_000
"""More are never searched in any time that somebody waits."""
MOST_CASES = 500_000
"""Combinations of values and of truths, all together."""


class TooLargeError(Exception):
    """A mission stands for more than can be looked at.

    `element`: what was being spelled out; `late`: it is the time that was too short.
    """

    def __init__(self, element: str, why: str, *, late: bool = False) -> None:
        super().__init__(f"{why}, while spelling out {element}")
        self.element = element
        self.late = late


@dataclass(slots=True)
class Bound:
    """`until_s`: by `time.monotonic`; None: whenever."""

    until_s: float | None = None
    most_rules: int = MOST_RULES
    rules: int = field(default=0, init=False)
    cases: int = field(default=0, init=False)

    def rule(self, element: str) -> None:
        """A rule is made for an element.

        Raises:
            TooLargeError: that is too many, or it takes too long.
        """
        self.rules += 1
        if self.rules > self.most_rules:
            raise TooLargeError(element, f"more than {self.most_rules:,} rules")
        self.look(element)

    def case(self, element: str) -> None:
        """One more combination of what an element reads or writes is gone through.

        Raises:
            TooLargeError: that is too many, or it takes too long.
        """
        self.cases += 1
        if self.cases > MOST_CASES:
            raise TooLargeError(element, f"more than {MOST_CASES:,} combinations of its data")
        self.look(element)

    def look(self, element: str) -> None:
        """Look at the clock.

        Raises:
            TooLargeError: it takes too long.
        """
        if self.until_s is not None and time.monotonic() > self.until_s:
            raise TooLargeError(element, "the limit of time", late=True)
