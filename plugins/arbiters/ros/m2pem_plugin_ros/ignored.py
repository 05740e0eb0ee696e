"""Tells of what is ignored, without telling of each."""

import logging
from collections import Counter


class Ignored:
    """Counts what is ignored by its cause; logs the 1st, the 10th, the 100th of each and so on.

    Whatever a vehicle floods us with, the log stays readable, and says how much it was.
    """

    def __init__(self, logger: logging.Logger, who: str) -> None:
        self.counts: Counter[str] = Counter()
        self._logger = logger
        self._who = who

    def add(self, cause: str, detail: str = "") -> None:
        """One more is ignored. `cause`: one of few; `detail`: of this one."""
        self.counts[cause] += 1
        count = self.counts[cause]
        if count == 10 ** (len(str(count)) - 1):
            so_far = f" ({count} so far)" if count > 1 else ""
            what = f"{cause}: {detail}" if detail else cause
            self._logger.warning("%s: ignored: %s%s", self._who, what, so_far)
