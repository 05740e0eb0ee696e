"""What a line of the log is about: which run, which vehicle or payload, which trace.

Structured logs have it as fields (`m2pem --log-format json`). What is logged while a run decides or
commands something is about that run. A resource is named where it is logged:

    log.warning("%s: no fix", vehicle, extra={"resource": vehicle})
"""

from contextvars import ContextVar

current_run: ContextVar[str] = ContextVar("current_run", default="")
"""The run of whose work the present code is a part; "": of none."""

trace_ids: dict[str, str] = {}
"""The ids of the traces of runs, in hexadecimal; those that trace the runs fill it in."""
