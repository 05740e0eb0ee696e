"""How long an answer is waited for, and how often it is asked for."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Patience:
    """It is asked `tries` times, and each time waited `answer_s` seconds."""

    tries: int
    answer_s: float

    @property
    def bound_s(self) -> float:
        """After so much silence it is over."""
        return self.tries * self.answer_s


PATIENCE = Patience(tries=5, answer_s=1.0)
"""For questions with one answer. mavlink.io, "Command Protocol", leaves times to the sender; ground
stations wait 0.5 to 1.5 s, three to five times. Links by satellite or mesh answer after 4 s."""
