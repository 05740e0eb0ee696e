"""A run of the journal as operators see it: one line of `m2pem runs`.

The command line reads it without an executive, which takes time to load.
"""

from m2pem.api.runs import RunStatus, RunSummary
from m2pem.journal.base import RunInfo


def summary(line: RunInfo) -> RunSummary:
    """A journal's line as operators see it."""
    if line.outcome is not None:
        status = RunStatus(line.outcome.value)
    elif not line.driven:
        status = RunStatus.INTERRUPTED
    else:
        status = RunStatus.PAUSED if line.paused else RunStatus.RUNNING
    detail = line.detail
    if line.loss is not None:
        detail = f"{line.loss}; {detail}" if detail else str(line.loss)
    return RunSummary(
        line.run,
        line.header.mission_name,
        line.header.process,
        status,
        line.started_us,
        line.ended_us,
        line.last_seq,
        detail,
        line.header.created_us,
    )
