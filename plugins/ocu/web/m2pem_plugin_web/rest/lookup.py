"""Finds the run that an address names."""

from m2pem.api import MissionControl, RunSummary
from m2pem_plugin_web.problems import ProblemError


async def find_run(control: MissionControl, run: str) -> RunSummary:
    """The run of that id.

    Raises:
        ProblemError: 404, there is none.
    """
    for summary in await control.runs():
        if summary.run == run:
            return summary
    raise ProblemError(404, f"there is no run {run}")
