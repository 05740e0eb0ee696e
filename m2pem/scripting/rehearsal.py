"""Rehearses a mission on a virtual clock: what `m2pem simulate` does, with the result as an object.

Where an event loop runs already (a notebook, a coroutine), the virtual clock gets a thread of its
own. `rehearse` then keeps that loop waiting; `rehearse_async` does not.
"""

import asyncio
import json
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from m2pem.api.authoring import MissionSource
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value
from m2pem.plugins import PluginManager
from m2pem.rehearsal import rehearsal
from m2pem.rehearsal.rehearsal import MAX_STEPS, START_US
from m2pem.scripting.run_result import RunResult
from m2pem.scripting.sources import FleetSource, fleet_of, load_mission


def rehearse(
    mission: MissionSource | Mission,
    fleet: FleetSource | None = None,
    *,
    process: str | None = None,
    data: Mapping[str, Value] | None = None,
    requirements: str | Path | bytes | None = None,
    answers: Mapping[str, Any] | str | Path | bytes | None = None,
    start: datetime | None = None,
    max_steps: int = MAX_STEPS,
    telemetry_every_s: float | None = None,
    search_path: Iterable[str | Path] = (),
) -> RunResult:
    """Run a mission to its end on simulated vehicles and a virtual clock, as `m2pem simulate`.

    The same mission, fleet and answers give the same records. `fleet` None: for a mission that
    commands no resource. `requirements`: a file of requirements beside the mission's own, or its
    text as bytes. `answers`: an answers file, its text as bytes, or its content as a dict.
    `start`: when it begins, 2026-01-01 by default; without a time zone it is UTC. `max_steps`:
    engine steps after which it is given up. `telemetry_every_s`: seconds of mission time between
    the positions in the result's telemetry; None: it has none.

    Raises:
        MissionError: the mission cannot be loaded, does not fit the fleet, or needs one.
        RequirementsError: requirements cannot be read, or do not fit; it lists all findings.
        AnswersError: the answers cannot be used, or do not fit the mission.
        FleetError: the fleet cannot be used.
    """
    loaded = load_mission(mission, search_path)
    used = None if fleet is None else fleet_of(fleet, loaded)
    result = rehearsal.rehearse(
        loaded,
        used,
        plugins=PluginManager(),
        process=process,
        data=data,
        spec=Path(requirements) if isinstance(requirements, str) else requirements,
        answers=json.dumps(answers).encode() if isinstance(answers, Mapping) else answers,
        start_us=START_US if start is None else _us(start),
        max_steps=max_steps,
        telemetry_every_s=telemetry_every_s,
    )
    return RunResult(loaded, used, result.summary, result.records, result.telemetry)


async def rehearse_async(
    mission: MissionSource | Mission, fleet: FleetSource | None = None, **options: Any
) -> RunResult:
    """As `rehearse`, with its options, in a thread: the event loop goes on meanwhile.

    A rehearsal whose caller is cancelled goes on to its end, or to `max_steps`.
    """
    return await asyncio.to_thread(rehearse, mission, fleet, **options)


def _us(start: datetime) -> int:
    zoned = start if start.tzinfo else start.replace(tzinfo=UTC)
    return round(zoned.timestamp() * 1_000_000)
