"""Which executive may still command a run."""

from m2pem.api.arbiter import BehaviorId

REMEMBERED = 10_000


class EpochFence:
    """The highest epoch seen for each run; the runs seen longest ago are forgotten."""

    def __init__(self) -> None:
        self._highest: dict[str, int] = {}

    def admit(self, behavior: BehaviorId, epoch: int) -> bool:
        """Whether a command of this epoch is good.

        "r1.b3" is a behavior of run r1, and "r1.b3.evsg1" a team's part of that behavior.
        """
        run = behavior.partition(".")[0]
        highest = max(epoch, self._highest.pop(run, epoch))
        self._highest[run] = highest
        if len(self._highest) > REMEMBERED:
            del self._highest[next(iter(self._highest))]
        return epoch >= highest
