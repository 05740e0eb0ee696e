"""What the operations of `MissionControl` are made of."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TypeAlias

from m2pem.api.authoring import MissionSource
from m2pem.api.estimates import MissionEstimate
from m2pem.api.runs import RunId, SimulationResult
from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.errors import OperatorError
from m2pem.executive.alert_list import AlertList
from m2pem.executive.direct_behaviors import DirectBehaviors
from m2pem.executive.ended_runs import explain_end, in_words
from m2pem.executive.health import ExecutiveHealth
from m2pem.executive.incidents import Foresee, IncidentChoices
from m2pem.executive.revisions import RunRevisions
from m2pem.executive.run_starter import RunStarter
from m2pem.executive.schedule_entries import ScheduleEntries
from m2pem.executive.scheduler import Scheduler
from m2pem.executive.statistics import StatisticsReader
from m2pem.executive.supervisor import Supervisor
from m2pem.executive.switchover import Switchover
from m2pem.fleet.fleet import Fleet
from m2pem.fleet.operator_roles import why_not_allowed
from m2pem.mission.mission import Mission
from m2pem.mission.values import MAX_DEPTH, Value, is_too_deep
from m2pem.telemetry.bus import Bus


class Rehearse(Protocol):
    """Rehearses missions for an executive, with the options of `MissionControl.simulate`."""

    async def __call__(
        self, mission: MissionSource, fleet: Fleet, *, search_path: Sequence[Path], **options: Any
    ) -> SimulationResult:
        """Rehearse a mission with a fleet. `search_path`: folders of processes that it calls."""
        ...


Estimate: TypeAlias = Callable[[Mission, Fleet, str | None], MissionEstimate]
"""Estimates what a mission takes with a fleet, from the start of a process; None: its main one."""


@dataclass(eq=False)
class ControlParts:
    """The parts of an executive that operations use."""

    _supervisor: Supervisor
    _starter: RunStarter
    _bus: Bus
    _health: ExecutiveHealth
    _schedule: ScheduleEntries
    _scheduler: Scheduler
    _switchover: Switchover
    _alerts: AlertList
    _statistics: StatisticsReader
    _rehearse: Rehearse | None = None
    _foresee: Foresee | None = None
    _estimate: Estimate | None = None

    def __post_init__(self) -> None:
        self._choices = IncidentChoices(self._supervisor, self._foresee)
        self._revisions = RunRevisions(self._supervisor, self._starter, self._choices)
        self._direct = DirectBehaviors(self._supervisor, self._starter)

    def _refuse_others(self, what: str, role: str, by: str) -> None:
        """Check that an operator has the role of those who decide about something.

        Raises:
            OperatorError: the fleet file says who has it: others.
        """
        if refusal := why_not_allowed(self._supervisor.fleet, role, by):
            raise OperatorError(f"{what}: {refusal}")

    async def _ask(self, request: str, run: RunId, item: i.Input) -> None:
        """Have an input decided; one that the engine ignored is the operator's to know.

        What came during a pause is decided with the resume, and may be ignored then: after it.
        """
        async with self._explain_end(request, run):
            match (await self._supervisor.runner(run).submit(item)).records:
                case [r.InputIgnored(reason), *_]:
                    raise OperatorError(f"{run}: {in_words(item, reason)}")

    def _explain_end(self, request: str, run: RunId) -> AbstractAsyncContextManager[None]:
        return explain_end(request, run, self._supervisor.runners, self._supervisor.journal)


def bounded(data: Mapping[str, Value] | None) -> dict[str, Value]:
    """Data from context, not nested deeper than the engine and the journal can take."""
    for name, value in (data or {}).items():
        if is_too_deep(value, MAX_DEPTH - 1):
            raise OperatorError(f"{name!r} is nested deeper than {MAX_DEPTH} levels")
    return dict(data or {})
