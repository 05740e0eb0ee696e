"""Records each run that this executive drives: MCAP files (docs/recording.md)."""

import asyncio
import logging
import time
from dataclasses import dataclass

from m2pem.api import (
    US_PER_S,
    Alert,
    Area,
    LocalFrame,
    MissionControl,
    Point,
    Route,
    RunId,
    RunStatus,
    RunView,
    StampedRecord,
    follow,
    shown_geometries,
)
from m2pem.api import records as r
from m2pem.api.follower import Listener
from m2pem.errors import M2pemError, PluginError
from m2pem_plugin_recorder.fleets import fleet_json
from m2pem_plugin_recorder.settings import RecorderSettings
from m2pem_plugin_recorder.telemetry_messages import RateLimit
from m2pem_plugin_recorder.writing_thread import Begin, End, Geometries, Warned, WritingThread

STATES_WAITING = 1000
PAGE = 1000

LAST_RECORDS_S = 1.0
"""How long the last records of a run may take from the executive to here, before they are read from
the journal."""
COMPLETE_S = 5.0
"""How long the end of an executive waits for records that are to be read from the journal."""

log = logging.getLogger("m2pem.face.recorder")


@dataclass(slots=True, eq=False)
class _Run:
    """A run that is recorded. `seq`: its last record that the thread has; `last`: the last one that
    it should have, as far as is known. `done`: it has ended, and its vehicles are released."""

    view: RunView
    begun: bool = False
    seq: int = 0
    last: int = 0
    done: bool = False


class Recorder(Listener):
    """Records runs, and telemetry for all runs that go on."""

    def __init__(self, control: MissionControl, settings: RecorderSettings) -> None:
        fleet = control.fleet()
        self._control = control
        self._runs: dict[RunId, _Run] = {}
        self._wake = asyncio.Event()
        self._limit = RateLimit(settings.rate_hz)
        self._geometries: dict[str, Point | Route | Area] = {}
        self._now_us = 0
        self._thread = WritingThread(
            settings,
            LocalFrame(fleet.origin),
            fleet_json(fleet),
            fleet.name,
            fleet.fence,
            self._room,
        )
        self._follower = follow(control, self)

    async def run(self) -> None:
        """Record until cancelled, then write what is left.

        Raises:
            PluginError: the disk takes no more.
        """
        self._loop = asyncio.get_running_loop()
        self._thread.start()
        self._put_geometries()
        try:
            async with asyncio.TaskGroup() as tasks:
                self._tasks = tasks
                tasks.create_task(self._follower.run(), name="recorder: records")
                tasks.create_task(self._take_states(), name="recorder: telemetry")
                tasks.create_task(self._read_on(), name="recorder: journal")
        except ExceptionGroup as group:
            raise group.exceptions[0] from None
        finally:
            if not self._thread.failure:
                await self._end()

    async def _end(self) -> None:
        try:
            async with asyncio.timeout(COMPLETE_S):
                await self._complete()
        except (TimeoutError, M2pemError) as error:
            log.warning("the flight recording lacks the last records: %s", error)
        await asyncio.to_thread(self._thread.end)
        if self._thread.dropped:
            log.warning("the disk was too slow for %d states", self._thread.dropped)

    # --- what the executive publishes -----------------------------------------------------------

    def run_added(self, view: RunView) -> None:
        """Record a run that went on before this executive followed it."""
        if view.seq and view.status in (RunStatus.RUNNING, RunStatus.PAUSED):
            self._tasks.create_task(self._take_up(view), name=f"recorder: {view.run}")

    def recorded(self, view: RunView, stamped: StampedRecord, *, is_new: bool) -> None:
        """Hand a record on; what does not follow is read from the journal."""
        if not is_new:
            return
        found = self._runs.get(view.run) or self._begin(view)
        found.last = max(found.last, stamped.seq)
        if found.begun and stamped.seq == found.seq + 1 and self._thread.put(stamped):
            found.seq = stamped.seq
        elif stamped.seq > found.seq:
            self._wake.set()
        if isinstance(stamped.record, r.RunStarted | r.GeometryReceived):
            self._put_geometries()

    def alerted(self, alert: Alert) -> None:
        """Hand an alert on."""
        self._thread.put(Warned(alert, self._time_us()))

    async def _take_states(self) -> None:
        async for state in self._control.telemetry(STATES_WAITING):
            self._now_us = max(self._now_us, state.time_us)
            if self._runs and self._limit.passes(state):
                self._thread.put_state(state)

    async def _take_up(self, view: RunView) -> None:
        try:
            await self._control.mission_time_s(view.run)
        except M2pemError:  # another executive drives it, or it has ended
            return
        if view.run not in self._runs:
            self._begin(view).last = view.seq
            self._wake.set()

    def _begin(self, view: RunView) -> _Run:
        found = self._runs[view.run] = _Run(view)
        found.begun = self._put_begin(view)
        self._tasks.create_task(self._await_end(found), name=f"recorder: end of {view.run}")
        return found

    def _put_begin(self, view: RunView) -> bool:
        summary = view.summary
        return self._thread.put(Begin(view.run, summary.mission, summary.started_us, view.mission))

    async def _await_end(self, found: _Run) -> None:
        try:
            summary = await self._control.wait(found.view.run)
            if found.seq < summary.records:
                await asyncio.sleep(LAST_RECORDS_S)
                found.last = summary.records
        except M2pemError as error:
            log.warning("%s: %s", found.view.run, error)
        found.done = True
        self._put_geometries()
        self._wake.set()

    def _put_geometries(self) -> None:
        """Hand on the routes, areas and points that are used now, if others were before."""
        found = shown_geometries(self._control)
        if found != self._geometries and self._thread.put(Geometries(found, self._time_us())):
            self._geometries = found

    def _time_us(self) -> int:
        """Return the time of the executive's clock; that of simulated vehicles may run ahead."""
        if self._control.speed() == 1.0:
            return round(time.time() * US_PER_S)
        return self._now_us or round(time.time() * US_PER_S)

    # --- what was missed ------------------------------------------------------------------------

    def _room(self) -> None:
        self._loop.call_soon_threadsafe(self._wake.set)

    async def _read_on(self) -> None:
        """Read from the journal what did not come in order, or did not fit."""
        while True:
            await self._wake.wait()
            self._wake.clear()
            if self._thread.failure:
                raise PluginError(self._thread.failure)
            self._put_geometries()
            for run, found in list(self._runs.items()):
                try:
                    whole = await self._read_run(found)
                except M2pemError as error:
                    log.warning("%s: the recording lacks records: %s", run, error)
                    whole = True
                if whole and found.done and self._thread.put(End(run)):
                    del self._runs[run]

    async def _read_run(self, found: _Run) -> bool:
        """Hand on the records up to the last one. False: there is no room now."""
        if not found.begun:
            found.begun = self._put_begin(found.view)
        while found.begun and found.seq < found.last:
            page = await self._page(found)
            if not page:
                break
            for stamped in page:
                if stamped.seq == found.seq + 1:  # others came meanwhile
                    if not self._thread.put(stamped):
                        return False
                    found.seq = stamped.seq
        return found.begun

    async def _page(self, found: _Run) -> list[StampedRecord]:
        """Return some of the records after the last one. A page begins with an input's records, of
        which the first ones may be here already."""
        back = 0
        while True:
            after = max(0, found.seq - back)
            page = await self._control.records(found.view.run, after, PAGE)
            if after == 0 or (page and page[0].seq <= found.seq + 1):
                return [each for each in page if each.seq > found.seq]
            back = max(1, back * 8)

    async def _complete(self) -> None:
        """Hand on the records that were committed and have not come yet."""
        lines = {each.run: each for each in await self._control.runs()}
        for run, found in list(self._runs.items()):
            if run in lines:
                found.last = max(found.last, lines[run].records)
            while not await self._read_run(found) and not self._thread.failure:
                self._wake.clear()
                await self._wake.wait()
