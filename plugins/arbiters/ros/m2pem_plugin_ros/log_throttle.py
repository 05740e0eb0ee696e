"""A log with a bounded rate, for faults in received messages.

A vehicle may send a thousand invalid messages a second, which must not fill the log.
"""

import logging
from collections import Counter


class LogThrottle:
    """Counts faults by their cause, and logs the 1st, the 10th, the 100th of each, and so on."""

    def __init__(self, logger: logging.Logger, who: str) -> None:
        self.counts: Counter[str] = Counter()
        self._logger = logger
        self._who = who

    def log(self, cause: str, detail: str = "", level: int = logging.WARNING) -> None:
        """Count a fault, and log it if it is due. `cause` is one of few texts; `detail` is that of
        this fault."""
        self.counts[cause] += 1
        count = self.counts[cause]
        if count == 10 ** (len(str(count)) - 1):
            so_far = f" ({count} so far)" if count > 1 else ""
            what = f"{cause}: {detail}" if detail else cause
            self._logger.log(level, "%s: %s%s", self._who, what, so_far)
