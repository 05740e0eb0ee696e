"""The log as one JSON object a line (`m2pem --log-format json`), for programs that collect logs.

A line has `time` (UTC, RFC 3339), `level`, `logger` and `message`; `run`, `trace_id` and
`resource`, where they are known; `error`, the type and text of what was raised, and `traceback`
with `--debug`.
"""

import json
import logging
from datetime import UTC, datetime

from m2pem.api.log_context import current_run, trace_ids


class JsonFormatter(logging.Formatter):
    """Makes a JSON object of a record, in one line. `tracebacks`: also of where it was raised."""

    makes_json = True

    def __init__(self, *, tracebacks: bool) -> None:
        super().__init__()
        self._tracebacks = tracebacks

    def format(self, record: logging.LogRecord) -> str:
        """Return the line, without its end. Called where it is logged, so that the run is known."""
        run = str(getattr(record, "run", "") or current_run.get())
        at = datetime.fromtimestamp(record.created, UTC)
        line = {
            "time": at.isoformat(timespec="microseconds").replace("+00:00", "Z"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
            "run": run,
            "trace_id": trace_ids.get(run, ""),
            "resource": str(getattr(record, "resource", "")),
        }
        if record.exc_info and (error := record.exc_info[1]) is not None:
            line["error"] = f"{type(error).__name__}: {error}"
            if self._tracebacks:
                line["traceback"] = self.formatException(record.exc_info)
        return json.dumps({key: value for key, value in line.items() if value}, ensure_ascii=False)
