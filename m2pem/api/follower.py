"""Follows all runs of an executive: a view of each, the open prompts, and every record.

An OCU makes a `Follower` with `follow(control, listener)` when it is made itself, so that it misses
nothing, and awaits `Follower.run` while it serves. The executive never waits for it: what comes
too fast is cut off and read from the journal afterwards, so that every record is applied.
"""

import asyncio
import logging
from collections.abc import AsyncIterator
from dataclasses import replace

from m2pem.api import records as r
from m2pem.api.alerts import AlertsChanged
from m2pem.api.allocation import SharedSpaceChanged
from m2pem.api.control import MissionControl
from m2pem.api.mission_control.watching import ControlEvent
from m2pem.api.people import OperatorsChanged
from m2pem.api.run_view import RunView
from m2pem.api.runs import (
    Alert,
    OpenPrompt,
    PromptClosed,
    RunId,
    RunStatus,
    RunSummary,
    StampedRecord,
)
from m2pem.api.schedule import ScheduleChanged
from m2pem.errors import JournalError, M2pemError, OperatorError

BACKLOG = 100_000
"""Notices that may wait; beyond that they are read from the journal."""

REMEMBERED_RUNS = 100
"""Ended runs that keep a view; the journal has all."""

NOTICES_IN_A_ROW = 200
"""Notices that are taken before other tasks run."""

RETRY_S = 1.0

PAGE = 1000

_STATUS_RECORDS = (r.RunStarted, r.RunClaimed, r.RunPaused, r.RunResumed, r.RunEnded)
_CLOSING_RECORDS = (r.PromptAnswered, r.PromptWithdrawn, r.RunEnded)
_SLOW_RECORDS = frozenset((*_STATUS_RECORDS, *_CLOSING_RECORDS, r.MissionRevised))

log = logging.getLogger("m2pem.ocu")


class Listener:
    """Callbacks of a follower; override those that you need. No call may block."""

    def run_added(self, view: RunView) -> None:
        """A run has a view now, up to its last record."""

    def recorded(self, view: RunView, stamped: StampedRecord, *, is_new: bool) -> None:
        """A record was applied. `is_new`: it was committed since the follower was made.

        A record that was committed while the follower loaded its run comes twice: first as part of
        what was loaded, then as new.
        """

    def status_changed(self, view: RunView) -> None:
        """A run began, ended, was paused, resumed or claimed."""

    def prompt_opened(self, prompt: OpenPrompt) -> None:
        """Called when a prompt opens."""

    def prompt_closed(self, prompt: OpenPrompt, closed: PromptClosed) -> None:
        """A prompt was answered or withdrawn."""

    def alerted(self, alert: Alert) -> None:
        """The executive warns of something that is in no run's records."""

    def alerts_changed(self) -> None:
        """The list of alerts has changed; `MissionControl.alerts` has it."""

    def schedule_changed(self) -> None:
        """The schedule has changed; `MissionControl.scheduled` has it."""

    def shared_space_changed(self) -> None:
        """Who is in shared space, or waits for it, has changed; `MissionControl.shared_space` has
        it."""

    def operators_changed(self) -> None:
        """Who is present, or asks for control, has changed; `MissionControl.operators` and
        `control_requests` have it."""


class Follower:
    """Views of runs and the open prompts. Made by `follow`.

    `listener` may be set until `run` or `load` is called.
    """

    def __init__(self, control: MissionControl, listener: Listener) -> None:
        self.views: dict[RunId, RunView] = {}
        self.prompts: dict[tuple[RunId, str], OpenPrompt] = {}
        self.notices_taken = 0
        self._control = control
        self.listener = listener
        self._events: AsyncIterator[ControlEvent] | None = control.subscribe(size=BACKLOG)
        self._loaded_up_to: dict[RunId, int] = {}
        """The last record that was applied to a view before it was added."""
        self._read_up_to: dict[RunId, int] = {}
        """The last record of the last page that was read of a run."""
        self._loading = asyncio.Lock()

    async def run(self) -> None:
        """Follow until the executive ends.

        Raises:
            M2pemError: it cannot be reached any more. It may be called again.
        """
        while True:
            self._events = self._events or self._control.subscribe(size=BACKLOG)
            try:
                await self._read_runs()
                views = self.views
                async for event in self._events:
                    self.notices_taken += 1
                    if (
                        type(event) is StampedRecord
                        and type(event.record) not in _SLOW_RECORDS
                        and (view := views.get(event.run)) is not None
                        and event.seq == view.seq + 1
                    ):
                        view.apply(event)  # most events: this must be fast
                        self.listener.recorded(view, event, is_new=True)
                    else:
                        await self._take(event)
                    if self.notices_taken % NOTICES_IN_A_ROW == 0:
                        await asyncio.sleep(0)
            except M2pemError as error:
                self._events = None
                if not isinstance(error, (OperatorError, JournalError)):
                    raise
                log.warning("%s", error)
                await asyncio.sleep(RETRY_S)
            else:
                return

    async def load(self, run: RunId) -> RunView:
        """Return the view of a run up to its last record, also of one that has ended.

        Raises:
            M2pemError: there is no such run, or it cannot be read.
        """
        async with self._loading:
            view = self.views.get(run)
            if view is None:
                summaries = {each.run: each for each in await self._control.runs()}
                if run not in summaries:
                    raise OperatorError(f"the journal has no run {run}")
                view = await self._view(summaries[run])
                await self._read_on(view, is_new=False)
                if summaries[run].status is RunStatus.INTERRUPTED:
                    view.interrupt()
                self._loaded_up_to[run] = view.seq
                self._add(view)
            return view

    # --- what the journal has -------------------------------------------------------------------

    async def _read_runs(self) -> None:
        """Read the runs that have not ended up to now: at first, and after events were lost."""
        for summary in await self._control.runs():
            view = self.views.get(summary.run)
            if view is not None and not view.status.ended:
                await self._read_on(view, is_new=True)
            elif view is None and not summary.status.ended:
                await self.load(summary.run)
        still_open = {(each.run, each.prompt) for each in self._control.prompts()}
        for key in self.prompts.keys() - still_open:
            self._close(PromptClosed(*key))

    async def _read_on(self, view: RunView, *, is_new: bool) -> None:
        """Read from the end of the last page, as a journal has no other places to read from."""
        while page := await self._control.records(
            view.run, self._read_up_to.get(view.run, 0), PAGE
        ):
            for stamped in page:
                if stamped.seq > view.seq:
                    if is_new and isinstance(stamped.record, r.MissionRevised):
                        await self._read_mission(view)
                    self._apply(view, stamped, is_new=is_new)
            self._read_up_to[view.run] = page[-1].seq
            await asyncio.sleep(0)

    async def _view(self, summary: RunSummary) -> RunView:
        view = RunView(summary)
        await self._read_mission(view)
        return view

    async def _read_mission(self, view: RunView) -> None:
        """Give a view the version of the mission that its run has now, for the names."""
        try:
            view.mission = await self._control.mission(view.run)
        except M2pemError as error:
            log.warning("%s: its diagram cannot be read: %s", view.run, error)

    def _add(self, view: RunView) -> None:
        self.views[view.run] = view
        ended = [run for run, each in self.views.items() if each.status.ended]
        for run in ended[:-REMEMBERED_RUNS]:
            del self.views[run]
            self._read_up_to.pop(run, None)
            self._loaded_up_to.pop(run, None)
        self.listener.run_added(view)

    # --- what happens ---------------------------------------------------------------------------

    async def _take(self, event: ControlEvent) -> None:
        match event:
            case StampedRecord():
                await self._take_record(event)
            case OpenPrompt(run=run, prompt=prompt):
                if run not in self.views:
                    await self.load(run)
                if (run, prompt) not in self.prompts:
                    self.prompts[run, prompt] = event
                    self.listener.prompt_opened(event)
            case PromptClosed():
                self._close(event)
            case Alert():
                self.listener.alerted(event)
            case ScheduleChanged():
                self.listener.schedule_changed()
            case AlertsChanged():
                self.listener.alerts_changed()
            case SharedSpaceChanged():
                self.listener.shared_space_changed()
            case OperatorsChanged():
                self.listener.operators_changed()

    async def _take_record(self, stamped: StampedRecord) -> None:
        view = self.views.get(stamped.run)
        if view is None and not isinstance(stamped.record, r.RunStarted):
            view = await self.load(stamped.run)  # an earlier run, claimed by this executive
        elif view is None:
            summaries = {each.run: each for each in await self._control.runs()}
            found = summaries.get(stamped.run) or RunSummary(
                stamped.run, "", "", RunStatus.RUNNING, 0
            )
            view = await self._view(  # as it was before this record
                replace(found, status=RunStatus.RUNNING, ended_us=None, detail="")
            )
            self._add(view)
        if stamped.seq == view.seq + 1:
            if isinstance(stamped.record, r.MissionRevised):
                await self._read_mission(view)
            self._apply(view, stamped, is_new=True)
        elif stamped.seq > view.seq:
            await self._read_on(view, is_new=True)
        elif stamped.seq <= self._loaded_up_to.get(view.run, 0):
            self._report(view, stamped)  # committed after subscribing, and loaded before it came

    def _apply(self, view: RunView, stamped: StampedRecord, *, is_new: bool) -> None:
        view.apply(stamped)
        if is_new:
            self._report(view, stamped)
        else:
            self.listener.recorded(view, stamped, is_new=False)

    def _report(self, view: RunView, stamped: StampedRecord) -> None:
        self.listener.recorded(view, stamped, is_new=True)
        record = stamped.record
        match record:
            case r.PromptAnswered(prompt=prompt, decision=decision, by=by):
                self._close(PromptClosed(stamped.run, prompt, decision, by))
            case r.PromptWithdrawn(prompt=prompt):
                self._close(PromptClosed(stamped.run, prompt))
            case r.RunEnded():
                for key in [key for key in self.prompts if key[0] == stamped.run]:
                    self._close(PromptClosed(*key))
        if isinstance(record, _STATUS_RECORDS):
            self.listener.status_changed(view)

    def _close(self, closed: PromptClosed) -> None:
        prompt = self.prompts.pop((closed.run, closed.prompt), None)
        if prompt is not None:
            self.listener.prompt_closed(prompt, closed)


def follow(control: MissionControl, listener: Listener | None = None) -> Follower:
    """Subscribe to all runs of an executive; `await follower.run()` follows them."""
    return Follower(control, listener or Listener())
