"""The replays that pages have open, and the indexes that are made while runs go on.

The index of a run that this executive drives while the page is served is made from the records that
pages are shown, and written when the run ends. Any other is made when the run is opened first.
"""

import asyncio
import logging
from collections import OrderedDict
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from m2pem.api import MissionControl, RunId, RunSummary, RunView, StampedRecord
from m2pem.api.records import RunEnded
from m2pem.errors import M2pemError
from m2pem_plugin_web.replay.files import IndexFiles
from m2pem_plugin_web.replay.index import Index, IndexBuilder, with_overview
from m2pem_plugin_web.replay.replay import Progress, Replay
from m2pem_plugin_web.replay.source import JournalSource, ListSource

KEPT = 6
"""Replays that are kept, those that were used last."""

AT_ONCE_S = 0.3
"""A page waits that long for an index before it is shown how far it is."""

log = logging.getLogger("m2pem.ocu.web")


@dataclass(slots=True, eq=False)
class Making:
    """An index that is made. `done`: of how many records of the run it is by now."""

    records: int
    task: "asyncio.Task[Replay]"
    done: int = 0


class Recordings:
    """Indexes of runs that go on. `recorded` is called for each record: it must be fast."""

    def __init__(self) -> None:
        self.ended = asyncio.Event()
        self._runs: dict[RunId, tuple[IndexBuilder, RunView]] = {}
        self._over: list[RunId] = []

    def recorded(self, view: RunView, stamped: StampedRecord) -> None:
        """Take a record that a view has just applied; a run counts from its first one on."""
        found = self._runs.get(stamped.run)
        if found is None:
            if stamped.seq != 1:
                return
            found = self._runs[stamped.run] = (IndexBuilder(stamped.run), view)
        found[0].add(view, stamped)
        if type(stamped.record) is RunEnded:
            self._over.append(stamped.run)
            self.ended.set()

    def index(self, run: RunId) -> Index | None:
        """Return the index of a run up to now; None: its beginning was not seen."""
        found = self._runs.get(run)
        if found is None or found[0].seq != found[1].seq:
            return None
        return found[0].index(found[1])

    def take_ended(self) -> list[Index]:
        """Return the indexes of runs that have ended since, and drop them."""
        self.ended.clear()
        over, self._over = self._over, []
        indexes = [self.index(run) for run in over]
        for run in over:
            self._runs.pop(run, None)
        return [each for each in indexes if each is not None]


class Replays:
    """The replays of runs of a journal, and of rehearsals."""

    def __init__(self, control: MissionControl) -> None:
        self.recordings = Recordings()
        self._control = control
        self._files = IndexFiles(control.journal_file())
        self._open: OrderedDict[str, Replay] = OrderedDict()
        self._making: dict[str, Making] = {}

    async def run(self) -> None:
        """Write the indexes of runs that end, until cancelled."""
        try:
            await self._forget_runs_of_before()
            while True:
                await self.recordings.ended.wait()
                for index in self.recordings.take_ended():
                    await asyncio.to_thread(self._finish, index)
        except Exception:  # the page works without: indexes are made when runs are opened
            log.exception("indexes of replays are no longer written")
        finally:
            for making in self._making.values():
                making.task.cancel()

    async def of_run(self, summary: RunSummary) -> Replay | Making:
        """Return the replay of a run that no executive drives, or how far its index is.

        Raises:
            M2pemError: its records cannot be read.
        """

        async def known() -> Index | None:
            recorded = self.recordings.index(summary.run)
            if recorded is not None and recorded.seq <= summary.records:
                return await asyncio.to_thread(with_overview, recorded)
            return await asyncio.to_thread(self._files.read, summary.run, summary.started_us)

        async def make(progress: Progress) -> Replay:
            before = await known()
            replay = await Replay.open(JournalSource(self._control, summary), before, progress)
            if before is not replay.index and summary.status.ended:
                await asyncio.to_thread(self._files.write, replay.index)
            return replay

        return await self._find(summary.run, summary.records, make)

    async def of_records(self, key: str, source: ListSource) -> Replay | Making:
        """Return the replay of a rehearsal; `key` names it."""

        async def make(progress: Progress) -> Replay:
            return await Replay.open(source, None, progress)

        return await self._find(key, source.summary.records, make)

    def opened(self, key: str) -> Replay | None:
        """Return a replay that was used not long ago."""
        found = self._open.get(key)
        if found is not None:
            self._open.move_to_end(key)
        return found

    async def _find(
        self, key: str, records: int, make: Callable[[Progress], Awaitable[Replay]]
    ) -> Replay | Making:
        found = self.opened(key)
        if found is not None and found.index.seq == records:
            return found
        making = self._making.get(key)
        if making is None:
            making = self._making[key] = self._begin(key, records, make)
        # Others may wait for the same one: who stops to wait ends nothing.
        await asyncio.wait([making.task], timeout=AT_ONCE_S)
        if not making.task.done():
            return making
        return making.task.result()

    def _begin(
        self, key: str, records: int, make: Callable[[Progress], Awaitable[Replay]]
    ) -> Making:
        async def work() -> Replay:
            try:
                replay = await make(progress)
            finally:
                del self._making[key]
            self._open[key] = replay
            self._open.move_to_end(key)
            while len(self._open) > KEPT:
                self._open.popitem(last=False)
            return replay

        def progress(done: int) -> None:
            making.done = done

        making = Making(records, asyncio.create_task(work(), name=f"web: the index of {key}"))
        making.task.add_done_callback(_look_at_error)
        return making

    def _finish(self, index: Index) -> None:
        self._files.write(with_overview(index))

    async def _forget_runs_of_before(self) -> None:
        try:
            runs = [(each.run, each.started_us) for each in await self._control.runs()]
        except M2pemError as error:
            log.warning("indexes of removed runs cannot be deleted: %s", error)
            return
        await asyncio.to_thread(self._files.keep_only, runs)


def _look_at_error(task: "asyncio.Task[Replay]") -> None:
    """A page that waits gets the error; asyncio reports it if no page is left."""
    if not task.cancelled():
        task.exception()
