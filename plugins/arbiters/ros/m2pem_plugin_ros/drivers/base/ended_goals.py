"""What became of the goals that a base was driven for."""

from collections import OrderedDict
from uuid import UUID

from m2pem_plugin_ros.drivers.driver import Outcome

KEPT = 1000


class EndedGoals:
    """The latest of them."""

    def __init__(self) -> None:
        self._outcomes: OrderedDict[UUID, Outcome] = OrderedDict()

    def add(self, goal: UUID, outcome: Outcome) -> None:
        """One more; the oldest goes when there are too many."""
        self._outcomes[goal] = outcome
        if len(self._outcomes) > KEPT:
            self._outcomes.popitem(last=False)

    def outcome(self, goal: UUID) -> Outcome | None:
        """How a goal has ended; None: it is not known here."""
        return self._outcomes.get(goal)
