"""The service `start_mission`."""

import asyncio
from typing import Any

from m2pem_plugin_ros import asker, bounded, decode_data, messages, mission_of

from m2pem.api import Finding, MissionControl, Value
from m2pem.errors import M2pemError, MissionError, OperatorError
from m2pem_plugin_mocu.requests import NAMELESS

MOST_FINDINGS = 200
"""In a response; the text says how many there are."""

PROCESS_CHARACTERS = 2000


async def start_mission(control: MissionControl, request: Any, response: Any) -> None:
    """Start it, and say what was found in it.

    Raises:
        M2pemError: it is refused; if for what is wrong in it, the response has the findings.
    """
    mission = mission_of(request)
    data = decode_data(request.data)
    process = bounded(request.process.strip(), "process", PROCESS_CHARACTERS) or None
    by = asker(request.by, NAMELESS)
    try:
        response.run = await control.start(mission, process=process, data=data, by=by)
    except MissionError as error:
        _tell(response, error.findings)
        raise OperatorError(_summary(error)) from error
    _tell(response, await _warnings(control, response.run, mission, process, data))


async def _warnings(
    control: MissionControl,
    run: str,
    mission: str | bytes,
    process: str | None,
    data: dict[str, Value],
) -> list[Finding]:
    """What is doubtful in a mission that has started; it goes on, whatever this finds."""
    try:
        loaded = await control.mission(run)
        # A file is read again for what is beside it; what came otherwise is not asked for again.
        is_file = isinstance(mission, str) and not mission.startswith(("http:", "https:"))
        again = mission if is_file else loaded.source
        found = await asyncio.to_thread(control.check, again, process=process, data=list(data))
    except M2pemError:
        return []
    return list(found)


def _tell(response: Any, findings: Any) -> None:
    response.findings = [messages.finding(each) for each in list(findings)[:MOST_FINDINGS]]
    if len(findings) > MOST_FINDINGS:
        response.message = f"{len(findings):,} findings, of which these are the first"


def _summary(error: MissionError) -> str:
    count = len(error.findings)
    first = f": {error.findings[0]}" if error.findings else ""
    more = f" (and {count - 1:,} more)" if count > 1 else ""
    return f"{error.what}{first}{more}"
