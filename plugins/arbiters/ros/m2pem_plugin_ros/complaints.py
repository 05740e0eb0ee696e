"""Complaints about what comes over a network, at a bounded rate: a fault may come a thousand times
a second, and must not fill the log."""

import logging
from collections.abc import Callable

EVERY_S = 10.0
MOST_KINDS = 100


class Complaints:
    """Logs the first of each kind at once, and those that follow once in a while, counted."""

    def __init__(
        self, logger: logging.Logger, now_us: Callable[[], int], every_s: float = EVERY_S
    ) -> None:
        self._logger = logger
        self._now_us = now_us
        self._every_us = round(every_s * 1_000_000)
        self._told: dict[str, tuple[int, int]] = {}

    def tell(self, kind: str, text: str, level: int = logging.WARNING) -> None:
        """Complain. Those of one kind are counted together, and the last text is logged."""
        now_us = self._now_us()
        last_us, unsaid = self._told.get(kind, (now_us - self._every_us, 0))
        if now_us - last_us < self._every_us:
            self._told[kind] = (last_us, unsaid + 1)
            return
        if kind not in self._told and len(self._told) >= MOST_KINDS:
            del self._told[next(iter(self._told))]
        self._told[kind] = (now_us, 0)
        more = f" ({unsaid} more like this)" if unsaid else ""
        self._logger.log(level, "%s%s", text, more)
