"""/api/run-pages: the runs of the journal by pages, filtered and sorted here."""

import asyncio
import time
from collections.abc import Callable, Collection, Iterable, Sequence
from enum import StrEnum
from typing import Annotated, Any

from fastapi import APIRouter, Query
from pydantic import BaseModel

from m2pem.api import MissionControl, RunStatus, RunSummary
from m2pem_plugin_web.access.permissions import Viewer
from m2pem_plugin_web.problems import RESPONSES
from m2pem_plugin_web.rest.models import RunModel
from m2pem_plugin_web.rest.run_resources import RunResources
from m2pem_plugin_web.rest.runs import GOING_ON, LARGEST, run_now

MOST = 200
FRESH_S = 1.0
"""For so long the list of runs that was read serves all pages."""


class SortedBy(StrEnum):
    """What runs are sorted by. ACTIVE: those that go on first, then by when they began."""

    ACTIVE = "active"
    BEGAN = "began"
    MISSION = "mission"
    STATUS = "status"
    TOOK = "took"


class RunsPage(BaseModel):
    """A page. `total`: how many runs are like what was asked for; `all`: how many there are.

    `unread`: of how many runs it is not known yet which vehicles they had: ask again.
    """

    runs: list[RunModel]
    total: int
    all: int
    unread: int = 0


class RunIndex:
    """The runs of the journal, read once a second at most, however many pages are open."""

    def __init__(self, control: MissionControl) -> None:
        self._control = control
        self._runs: Sequence[RunSummary] = ()
        self._read_s = float("-inf")
        self._reading = asyncio.Lock()

    async def runs(self) -> Sequence[RunSummary]:
        """Every run."""
        async with self._reading:
            if time.monotonic() - self._read_s > FRESH_S:
                self._runs = await self._control.runs()
                self._read_s = time.monotonic()
            return self._runs


def _began_us(run: RunSummary) -> int:
    return run.began_us or run.started_us


_KEYS: dict[SortedBy, Callable[[RunSummary], Any]] = {
    SortedBy.ACTIVE: lambda run: (run.status in GOING_ON, _began_us(run)),
    SortedBy.BEGAN: _began_us,
    SortedBy.MISSION: lambda run: (run.mission.lower(), _began_us(run)),
    SortedBy.STATUS: lambda run: (run.status, _began_us(run)),
    SortedBy.TOOK: lambda run: (run.took_s if run.took_s is not None else -1, _began_us(run)),
}


def found(
    runs: Iterable[RunSummary],
    *,
    statuses: Collection[RunStatus] = (),
    text: str = "",
    since_us: int = 0,
    until_us: int = LARGEST,
    sort: SortedBy = SortedBy.ACTIVE,
    descending: bool = True,
) -> list[RunSummary]:
    """Return the runs that are like this, sorted. `text`: in the id, the mission, the process or
    the detail."""
    words = text.casefold().split()

    def wanted(run: RunSummary) -> bool:
        if statuses and run.status not in statuses:
            return False
        if not since_us <= _began_us(run) <= until_us:
            return False
        said = f"{run.run} {run.mission} {run.process} {run.detail}".casefold() if words else ""
        return all(word in said for word in words)

    return sorted(filter(wanted, runs), key=_KEYS[sort], reverse=descending)


def router(control: MissionControl) -> APIRouter:
    """The route of pages of runs."""
    routes = APIRouter(prefix="/api/run-pages", tags=["runs"], responses=RESPONSES)
    index = RunIndex(control)
    resources = RunResources(control)

    async def commanding(resource: str) -> set[str]:
        """The runs that have a vehicle or payload now."""
        holders = await control.holders()
        return {
            holder.partition(".")[0]
            for each, holder in holders.items()
            if each == resource or each.startswith(f"{resource}/")
        }

    @routes.get("")
    async def page(
        _: Viewer,
        status: Annotated[list[RunStatus], Query(max_length=len(RunStatus))] = [],  # noqa: B006
        text: Annotated[str, Query(max_length=200)] = "",
        vehicle: Annotated[str, Query(max_length=200)] = "",
        since_us: Annotated[int, Query(ge=0, le=LARGEST)] = 0,
        until_us: Annotated[int, Query(ge=0, le=LARGEST)] = LARGEST,
        sort: SortedBy = SortedBy.ACTIVE,
        descending: bool = True,
        offset: Annotated[int, Query(ge=0, le=LARGEST)] = 0,
        limit: Annotated[int, Query(ge=1, le=MOST)] = 25,
    ) -> RunsPage:
        """Runs by pages. `text`: all its words are in the id, mission, process or detail.
        `vehicle`: only the runs that have or had it, or a payload on it."""
        runs = await index.runs()
        lines = await asyncio.to_thread(
            found,
            runs,
            statuses=frozenset(status),
            text=text,
            since_us=since_us,
            until_us=until_us,
            sort=sort,
            descending=descending,
        )
        unread = 0
        if vehicle:
            resources.keep({each.run for each in runs})
            now = await commanding(vehicle)
            had, unread = await resources.having(vehicle, lines)
            lines = [each for each in lines if each.run in had or each.run in now]
        return RunsPage(
            runs=[await run_now(control, each) for each in lines[offset : offset + limit]],
            total=len(lines),
            all=len(runs),
            unread=unread,
        )

    return routes
