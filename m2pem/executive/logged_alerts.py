"""What is logged as a warning about vehicles and runs, operators see wherever they are.

Standard error is read by who started the program, the web page and a ROS console are not.
"""

import asyncio
import logging
from types import TracebackType
from typing import Self

from m2pem.api.control import LOGGED, Alert
from m2pem.executive.notices import Notices

LOGGERS = ("m2pem.arbiter", "m2pem.dispatch", "m2pem.executive", "m2pem.teams")


class LoggedAlerts(logging.Handler):
    """Between `__enter__` and `__exit__`, in an event loop: each warning or error is an alert."""

    def __init__(self, notices: Notices) -> None:
        super().__init__(logging.WARNING)
        self._notices = notices

    def __enter__(self) -> Self:
        self._loop = asyncio.get_running_loop()
        for name in LOGGERS:
            logging.getLogger(name).addHandler(self)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        for name in LOGGERS:
            logging.getLogger(name).removeHandler(self)

    def emit(self, record: logging.LogRecord) -> None:
        """Any thread may log."""
        alert = Alert("", LOGGED, record.getMessage())
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._notices.publish, alert)
