"""Complaints about what others say, at a bounded rate: a fault may come a thousand times a second,
and must not fill the log."""

import logging
from collections import Counter


class Complaints:
    """Counts them by their cause; logs the 1st, the 10th, the 100th of each, and so on.

    Whatever a vehicle floods us with, the log stays readable, and says how much it was.
    """

    def __init__(self, logger: logging.Logger, who: str) -> None:
        self.counts: Counter[str] = Counter()
        self._logger = logger
        self._who = who

    def add(self, cause: str, detail: str = "", level: int = logging.WARNING) -> None:
        """One more. `cause`: one of few; `detail`: of this one."""
        self.counts[cause] += 1
        count = self.counts[cause]
        if count == 10 ** (len(str(count)) - 1):
            so_far = f" ({count} so far)" if count > 1 else ""
            what = f"{cause}: {detail}" if detail else cause
            self._logger.log(level, "%s: %s%s", self._who, what, so_far)
