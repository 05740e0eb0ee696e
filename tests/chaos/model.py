"""An executive in this process, on a real journal file and virtual time, which can be dropped.

What is dropped is closed in nothing: its event loop is not run any more. Its vehicles are those of
a state file, and go on.
"""

import asyncio
import gc
import logging
import threading
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

from m2pem.api.arbiter import ArbiterContext, BehaviorReport, Connection
from m2pem.api.clock import VirtualClock, VirtualLoop
from m2pem.api.runs import RunId
from m2pem.engine.records import Record, RunEnded
from m2pem.engine.state import RunOutcome
from m2pem.errors import M2pemError
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet_file import load_fleet
from m2pem.journal.base import Entry
from m2pem.journal.sqlite import SqliteJournal
from m2pem.mission.catalogue import ResourceId
from m2pem.plugins import PluginManager
from m2pem.simulation.arbiters import SimArbiter
from m2pem.simulation.executions import EffectKind
from tests.chaos.worlds import SimulatedVehicles

T = TypeVar("T")


class JournalInThread:
    """An SQLite journal whose calls are work of a thread: virtual time stands still meanwhile."""

    def __init__(self, path: Path) -> None:
        self._loop = asyncio.new_event_loop()
        self._journal = SqliteJournal.open(path)
        self.identity, self.file = self._journal.identity, self._journal.file
        self.lease_s, self.owned_until_s = self._journal.lease_s, self._journal.owned_until_s
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()
        self._calls = ThreadPoolExecutor(thread_name_prefix="calls of a journal")

    def __getattr__(self, name: str) -> Callable[..., Awaitable[Any]]:
        method = getattr(self._journal, name)

        async def call(*arguments: Any, **named: Any) -> Any:
            return await self._run(lambda: method(*arguments, **named))

        return call

    async def read(self, run: str, after_seq: int = 0) -> AsyncIterator[Entry]:
        """See `Journal.read`."""

        async def entries() -> list[Entry]:
            return [each async for each in self._journal.read(run, after_seq)]

        for entry in await self._run(entries):
            yield entry

    async def _run(self, call: Callable[[], Any]) -> Any:
        def wait() -> Any:
            return asyncio.run_coroutine_threadsafe(call(), self._loop).result()

        return await asyncio.get_running_loop().run_in_executor(self._calls, wait)

    def drop(self) -> None:
        """Let go of its files, as the system does when a process ends."""
        asyncio.run_coroutine_threadsafe(self._journal.close(), self._loop).result()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()
        self._calls.shutdown(wait=False)


class Unreliable(SimArbiter):
    """Vehicles whose reports come twice, late and in another order, beside the right ones."""

    def __init__(self, connections: dict[ResourceId, Connection], context: ArbiterContext) -> None:
        super().__init__(connections, context)
        self.reported: list[BehaviorReport] = []
        self.again: list[int] = []

    def addresses(self, resource: ResourceId) -> Sequence[str]:
        """None: what was dropped does not let go of their locks."""
        return ()

    async def reports(self) -> AsyncIterator[BehaviorReport]:
        """Reports as they come; before each, some of those that came before."""
        async for report in super().reports():
            places, self.again = self.again, []
            for place in places:
                if self.reported:
                    yield self.reported[place % len(self.reported)]
            self.reported.append(report)
            yield report
            if places:
                yield report


class _Plugins(PluginManager):
    def __init__(self, made: list[Unreliable]) -> None:
        super().__init__(block=("all",))
        self._made = made

    def arbiter(self, name: str) -> Callable[..., Any]:
        def make(connections: Any, context: ArbiterContext) -> Unreliable:
            self._made.append(Unreliable(connections, context))
            return self._made[-1]

        return make if name == "sim" else super().arbiter(name)


class Life:
    """One executive, from its start until it is dropped. `seen`: the records that it committed.

    `cancelled`: by stopped run, what vehicles had been told to cancel when the stop was committed.
    """

    def __init__(self, folder: Path, vehicles: SimulatedVehicles, now_us: int) -> None:
        self.seen: list[tuple[RunId, Record]] = []
        self.cancelled: dict[RunId, set[str]] = {}
        self._handlers = list(logging.getLogger().handlers)
        self._loop = VirtualLoop()
        self._threads = ThreadPoolExecutor(thread_name_prefix="a life")
        self._loop.set_default_executor(self._threads)
        self.clock = VirtualClock(self._loop, now_us)
        self.journal = JournalInThread(folder / "journal.db")
        made: list[Unreliable] = []

        def on_records(run: RunId, records: Sequence[Record]) -> None:
            self.seen.extend((run, each) for each in records)
            if any(isinstance(e, RunEnded) and e.outcome is RunOutcome.STOPPED for e in records):
                told = (e.behavior for e in made[0].effects if e.kind is EffectKind.CANCEL)
                self.cancelled[run] = set(told)

        self.executive = Executive(
            load_fleet(vehicles.fleet),
            self.journal,  # type: ignore[arg-type]  # its methods are made by name
            _Plugins(made),
            self.clock,
            watch_links=False,
            on_records=on_records,
        )
        self.vehicles = made[0]
        self.control = self.executive.control
        self.act(self._begin())

    async def _begin(self) -> None:
        runs = await self.journal.runs()
        left = [each.run for each in runs if each.outcome is None and each.last_seq]
        self.executive.supervisor.interrupted.expect(left)
        await self.executive.__aenter__()
        refused = await self.executive.resume_all(left)
        assert not refused, refused

    def act(self, what: Awaitable[T]) -> T:
        """Let the executive run until something is done."""

        async def main() -> T:
            return await what

        return self._loop.run_until_complete(main())

    def ask(self, what: Awaitable[Any]) -> str:
        """As `act`, for what an operator may be refused; returns why, or ""."""
        try:
            self.act(what)
        except M2pemError as error:
            return str(error)
        return ""

    def link(self, vehicle: str, *, up: bool) -> None:
        """Break the link to a vehicle, or mend it."""

        async def change() -> None:
            change_it = self.vehicles.restore_link if up else self.vehicles.lose_link
            change_it(ResourceId(vehicle))

        self.act(change())

    def pass_s(self, seconds: float) -> None:
        """Let time pass."""
        self.act(self.clock.sleep(seconds))

    def drop(self) -> None:
        """The process is gone."""
        self.journal.drop()
        self._threads.shutdown(wait=False)
        for task in asyncio.all_tasks(self._loop):
            task.set_name("dropped")
        logging.getLogger().handlers[:] = self._handlers
        logging.getLogger("asyncio").setLevel(logging.CRITICAL)  # tasks that are dropped
        with suppress(AttributeError):
            del self.executive
        gc.collect()
