"""A run's records as lines for people: mission time, the run if there are several, a sentence."""

from collections.abc import Callable

import click

from m2pem.api import records as r
from m2pem.api.description import Description, Importance, Kind, describe
from m2pem.api.run_view import Allocation, Behavior, RunView
from m2pem.api.runs import RunId, RunStatus, RunSummary, StampedRecord
from m2pem.engine.elements.allocations import behavior_of
from m2pem.engine.state import RunState
from m2pem.mission.elements import Activity, Event
from m2pem.mission.mission import Mission

SHOWN = frozenset(
    (
        r.RunStarted,
        r.RunClaimed,
        r.RunPaused,
        r.RunResumed,
        r.RunEnded,
        r.MissionRevised,
        r.BreakpointReached,
        r.OperatorSetData,
        r.TokenEntered,
        r.TokenLeft,
        r.AllocationDelayed,
        r.ResourcesAllocated,
        r.BehaviorRequested,
        r.BehaviorEnded,
        r.WorkReassigned,
        r.ResourceReturned,
        r.ResourceKept,
        r.KeepingEnded,
        r.BehaviorUnsettled,
        r.BehaviorAdjusted,
        r.BehaviorContinued,
        r.BehaviorRestarted,
        r.PromptOpened,
        r.PromptAnswered,
        r.ServiceRequested,
        r.ServiceEnded,
        r.SignalThrown,
        r.MessageThrown,
        r.EscalationThrown,
        r.ErrorThrown,
        r.FlowTaken,
        r.IncidentOpened,
        r.IncidentUpdated,
        r.IncidentResolved,
        r.IncidentClosed,
        r.CompensationTriggered,
        r.CompensationBegan,
        r.TransactionCancelled,
        r.GeometryReceived,
        r.RequirementDecided,
        r.RequirementLeftOpen,
    )
)
"""Records that are printed; the others matter to programs only."""

NAMING = frozenset(
    (
        r.AllocationRequested,
        r.AllocationDelayed,
        r.ResourcesAllocated,
        r.AllocationEnded,
        r.BehaviorRequested,
        r.BehaviorEnded,
        r.PromptOpened,
        r.PromptAnswered,
        r.PromptWithdrawn,
    )
)
"""Records that a view needs, so that later lines can name behaviors and prompts."""

_READ = SHOWN | NAMING

REMEMBERED_RUNS = 1000
"""Runs of which names are known; the oldest are forgotten."""

_COLOURS_BY_IMPORTANCE = {
    Importance.GOOD: "green",
    Importance.WARNING: "yellow",
    Importance.ERROR: "red",
}
_COLOURS_BY_KIND = {Kind.BEHAVIORS: "cyan", Kind.PROMPTS: "green", Kind.EVENTS: "magenta"}


class LineFormatter:
    """Formats records as lines. `mission` returns the diagram of a run.

    `colour`: for a terminal. `one`: lines of the first run do not name it. `asks`: whether prompts
    are printed, which an operator's own unit may show better.
    """

    def __init__(
        self,
        mission: Callable[[RunId], Mission | None],
        *,
        colour: bool = False,
        one: bool = True,
        asks: bool = True,
    ) -> None:
        self._main: RunId | None = None if one else ""
        self._asks = asks
        self._mission = mission
        self._colour = colour
        self._views: dict[RunId, RunView] = {}

    def restore(self, state: RunState) -> None:
        """Add the behaviors and requests for resources of a run that was begun before."""
        view = self._view(state.run)
        for request in state.allocations.values():
            token = request.token
            view.allocations[request.id] = Allocation(
                request.id,
                behavior_of(request).name,
                token.scope.container.process.id,
                token.node.id,
                token.id,
                0.0,
            )
        for each in state.behaviors.values():
            view.behaviors[each.id] = Behavior(
                each.id, each.name, each.resources, each.process, each.element, each.token, 0.0
            )

    def format(self, stamped: StampedRecord) -> str | None:
        """Return one line for a record; None for one that is not shown."""
        record = stamped.record
        if type(record) not in _READ:
            return None
        if self._main is None:
            self._main = stamped.run
        view = self._view(stamped.run)
        if type(record) in NAMING:
            view.apply(stamped)
        if not self._is_shown(view, record):
            return None
        description = describe(stamped, view)
        if isinstance(record, r.MissionRevised):
            view.mission = self._mission(stamped.run)
        run = "" if stamped.run == self._main else f"{stamped.run:<4} "
        line = f"{stamped.t_s:9.1f} s  {run}{description.text}"
        colour = _colour(description) if self._colour else None
        return click.style(line, fg=colour) if colour else line

    def _view(self, run: RunId) -> RunView:
        view = self._views.get(run)
        if view is None:
            view = self._views[run] = RunView(RunSummary(run, "", "", RunStatus.RUNNING, 0))
            if len(self._views) > REMEMBERED_RUNS:
                del self._views[next(iter(self._views))]
        if view.mission is None:
            view.mission = self._mission(run)
        return view

    def _is_shown(self, view: RunView, record: r.Record) -> bool:
        if isinstance(record, r.TokenEntered):
            return _is_activity_or_event(view, record.element)
        if isinstance(record, r.TokenLeft):
            interrupted = record.outcome is r.TokenOutcome.INTERRUPTED
            return interrupted and _is_activity_or_event(view, record.element)
        if isinstance(record, r.PromptOpened):
            return self._asks
        if isinstance(record, r.FlowTaken):
            return bool(record.reason)
        return type(record) in SHOWN


def _is_activity_or_event(view: RunView, element: str) -> bool:
    mission = view.mission
    return mission is None or isinstance(mission.elements.get(element), (Activity, Event))


def _colour(description: Description) -> str | None:
    if description.importance in _COLOURS_BY_IMPORTANCE and not (
        description.kind is Kind.BEHAVIORS and description.importance is Importance.GOOD
    ):
        return _COLOURS_BY_IMPORTANCE[description.importance]
    return _COLOURS_BY_KIND.get(description.kind)
