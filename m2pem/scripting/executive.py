"""Executes missions from Python, with vehicles that are real or simulated, and answers prompts.

    async with m2pem.Executive("fleet.yaml", simulate=True, journal="memory:") as executive:
        run = await executive.start("mission.bpmn")
        async for prompt in run.prompts():
            await prompt.answer("continue")
        result = await run.wait()

It is the executive of `m2pem run`: other processes find it by its journal (`m2pem attach`, `m2pem
stop`), and a run that it leaves unfinished is taken up by `m2pem resume`.
"""

import asyncio
from collections.abc import AsyncIterator, Iterable, Mapping, Sequence
from contextlib import AsyncExitStack
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from m2pem.api.authoring import MissionSource
from m2pem.api.clock import SystemClock
from m2pem.api.control import MissionControl
from m2pem.api.mission_control.watching import ControlEvent
from m2pem.api.operator import operator_name
from m2pem.api.runs import OpenPrompt, RunId, RunStatus, RunSummary, SimulationResult, StampedRecord
from m2pem.control_socket.server import ControlSocket
from m2pem.engine.records import RunEnded
from m2pem.errors import FleetError, OperatorError, PluginError
from m2pem.executive import executive as core
from m2pem.executive.control import Control
from m2pem.executive.outlook_worker import outlook_in_subprocess
from m2pem.executive.process_monitors import LoopMonitor
from m2pem.executive.simulated_state import tidy_up, with_own_state
from m2pem.fleet.fleet import Fleet, real_resources, simulated_fleet
from m2pem.fleet.fleet_file import load_fleet
from m2pem.journal import default_url, file_of, open_journal
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value
from m2pem.plugins import PluginManager
from m2pem.rehearsal.worker import rehearse_in_subprocess
from m2pem.scripting.run_result import RunResult
from m2pem.simulation.estimates import estimate_mission

BACKLOG = 1_000_000
"""The maximum number of events that wait for a reader of `Run.records` or `Run.prompts`."""


class Prompt:
    """A question of a user task to an operator. The first answer wins.

    `decisions`: the values that answer it, each with its label.
    """

    def __init__(self, control: MissionControl, opened: OpenPrompt, by: str) -> None:
        self.id = opened.prompt
        self.element = opened.element
        self.text = opened.text
        self.role = opened.role
        self.decisions = {each.value: each.label for each in opened.decisions}
        self._run = opened.run
        self._control = control
        self._by = by

    async def answer(self, decision: str) -> None:
        """Answer it with one of its decisions.

        Raises:
            OperatorError: it has no such decision, or has been answered or withdrawn.
        """
        await self._control.answer(self._run, self.id, decision, by=self._by)

    def __repr__(self) -> str:
        return f"<Prompt {self.element}: {self.text} [{', '.join(self.decisions)}]>"


class Run:
    """A run that this executive drives. Made by `Executive.start`.

    Requests that cannot be met raise OperatorError and change nothing.
    """

    def __init__(self, control: MissionControl, run: RunId, mission: Mission, by: str) -> None:
        self.id = run
        self.mission = mission
        self._control = control
        self._by = by

    async def wait(self) -> RunResult:
        """Wait until it has ended and its vehicles are released."""
        summary = await self._control.wait(self.id)
        records: list[StampedRecord] = []
        while page := await self._control.records(self.id, records[-1].seq if records else 0):
            records += page
        return RunResult(self.mission, self._control.fleet(), summary, records)

    async def status(self) -> RunStatus:
        """Return its status now."""
        return next(each.status for each in await self._control.runs() if each.run == self.id)

    async def records(self) -> AsyncIterator[StampedRecord]:
        """Yield its records from the first to its end, each as soon as it is in the journal."""
        last = 0
        events = self._control.subscribe(self.id, BACKLOG)
        while page := await self._control.records(self.id, last):
            for stamped in page:
                yield stamped
                last = stamped.seq
                if isinstance(stamped.record, RunEnded):
                    return
        async for event in events:
            if isinstance(event, StampedRecord) and event.seq > last:
                yield event
                last = event.seq
                if isinstance(event.record, RunEnded):
                    return

    async def prompts(self) -> AsyncIterator[Prompt]:
        """Yield the prompts that are open, and then each one that opens, until the run ends."""
        events = self._control.subscribe(self.id, BACKLOG)
        ended = asyncio.ensure_future(self._control.wait(self.id))
        try:
            while (event := await _next_before(events, ended)) is not None:
                if isinstance(event, OpenPrompt):
                    yield Prompt(self._control, event, self._by)
            if ended.done():
                ended.result()  # raises the error that has ended the run
        finally:
            ended.cancel()

    async def pause(self) -> None:
        """Hold every commanded resource and stop mission time."""
        await self._control.pause(self.id, by=self._by)

    async def resume(self) -> None:
        """Let it go on after a pause."""
        await self._control.resume(self.id, by=self._by)

    async def stop(self, reason: str = "") -> None:
        """End it: the cancels of its behaviors go to the vehicles at once."""
        await self._control.stop(self.id, by=self._by, reason=reason)

    async def signal(self, signal: str, data: Mapping[str, Value] | None = None) -> None:
        """Send a signal, by its id or its name, with data."""
        await self._control.signal(signal, run=self.id, data=data, by=self._by)

    async def message(self, message: str, data: Mapping[str, Value] | None = None) -> None:
        """Send a message, by its id, with data."""
        await self._control.message(message, run=self.id, data=data, by=self._by)

    def __repr__(self) -> str:
        return f"<Run {self.id} of {self.mission.file}>"


async def _next_before(
    events: AsyncIterator[ControlEvent], ended: "asyncio.Future[RunSummary]"
) -> ControlEvent | None:
    """The next event; None: the run has ended, or the executive."""
    waiting = asyncio.ensure_future(anext(events, None))
    try:
        await asyncio.wait((waiting, ended), return_when=asyncio.FIRST_COMPLETED)
        return waiting.result() if waiting.done() else None
    finally:
        waiting.cancel()


async def _rehearse(*arguments: Any, **options: Any) -> SimulationResult:
    return await rehearse_in_subprocess(*arguments, **options)


class Executive:
    """Connects to the vehicles of a fleet and executes missions.

    Within an `async with` block; or from `connect` to `close`, so that a notebook starts a run in
    one cell and steers it in the next. The end stops what still runs, and waits until its vehicles
    are released.

    `fleet`: one that was loaded, or the path of a fleet file. `simulate`: every vehicle and payload
    is simulated. `speed`: of simulated vehicles and timers against the wall clock. `journal`: a
    path, `sqlite:///path`, `postgresql://user@host/database` or `memory:`; None: the user's own, as
    on the command line.
    `search_path`: folders of processes that missions call. `by`: the operator's name in the
    journal; None: M2PEM_OPERATOR, else user and host.

    The executive lives in the event loop that it was connected in: code that blocks this loop
    delays STOP, too, and an alert says so.

    Raises:
        FleetError: the fleet cannot be used.
    """

    def __init__(
        self,
        fleet: Fleet | str | Path,
        *,
        simulate: bool = False,
        speed: float = 1.0,
        journal: str | Path | None = None,
        search_path: Iterable[str | Path] = (),
        by: str | None = None,
    ) -> None:
        loaded = fleet if isinstance(fleet, Fleet) else load_fleet(fleet)
        self._fleet = simulated_fleet(loaded) if simulate else loaded
        self._speed = speed
        self._url = default_url() if journal is None else str(journal)
        self._search_path: Sequence[Path] = [Path(each) for each in search_path]
        self._by = operator_name() if by is None else by
        self._control: Control | None = None
        self._closing = asyncio.Event()
        self._serving: asyncio.Task[None] | None = None

    @property
    def control(self) -> Control:
        """All that operators can do, over all runs: see `m2pem.api.MissionControl`.

        Raises:
            OperatorError: the executive is not connected.
        """
        if self._control is None:
            raise OperatorError(
                "the executive is not connected: use it in `async with`, or await connect()"
            )
        return self._control

    async def connect(self) -> Self:
        """Open the journal and connect to the vehicles.

        Raises:
            OperatorError: it is connected already.
            FleetError: the fleet names an arbiter that no plugin provides, or has real vehicles
                and the speed is not 1.
            JournalError: the journal cannot be opened.
            VehicleInUseError: another executive commands a vehicle of the fleet.
        """
        if self._serving is not None:
            raise OperatorError("the executive is connected already")
        self._closing.clear()
        connected: asyncio.Future[Control] = asyncio.get_running_loop().create_future()
        # A separate task: what is opened must be closed in the same task, and `connect` and
        # `close` may be called in two.
        self._serving = asyncio.create_task(self._serve(connected), name="executive")
        try:
            self._control = await connected
        except BaseException:
            self._serving.cancel()
            await asyncio.wait([self._serving])
            self._serving = None
            raise
        return self

    async def close(self) -> None:
        """Stop what still runs, wait until its vehicles are released, and close the journal.

        Nothing happens if it is not connected.
        """
        self._control = None
        self._closing.set()
        if self._serving is not None:
            await asyncio.shield(self._serving)
            self._serving = None

    async def __aenter__(self) -> Self:
        return await self.connect()

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        await self.close()

    async def start(
        self,
        mission: MissionSource | Mission,
        *,
        process: str | None = None,
        data: Mapping[str, Value] | None = None,
        even_if_busy: bool = False,
    ) -> Run:
        """Start a mission; returns when its beginning is in the journal.

        `process`: the one to begin with, the main one by default; `data`: what it starts with.
        `even_if_busy`: although other runs or operators have vehicles that it names.

        Raises:
            MissionError: with every finding, when it is wrong or does not fit the fleet.
            BusyError: others have vehicles that it names, unless `even_if_busy`.
        """
        control = self.control
        run = await control.start(
            mission, process=process, data=data, by=self._by, even_if_busy=even_if_busy
        )
        return Run(control, run, await control.mission(run), self._by)

    async def _serve(self, connected: "asyncio.Future[Control]") -> None:
        """Be connected until `close` is called."""
        try:
            async with AsyncExitStack() as stack:
                control = await self._open(stack)
                connected.set_result(control)
                await self._closing.wait()
        except Exception as error:
            if connected.done():
                raise
            connected.set_exception(error)

    async def _open(self, stack: AsyncExitStack) -> Control:
        """Open all that `stack` then closes."""
        file = file_of(self._url)
        journal = open_journal(self._url)
        stack.push_async_callback(journal.close)
        fleet = with_own_state(self._fleet, file)
        if self._speed != 1.0 and (real := real_resources(fleet)):
            raise FleetError(
                f"speed {self._speed:g}: {', '.join(real)} of {fleet.file} would be real; add "
                "simulate=True, or mark what is software in the loop with `sitl: true`",
                (),
            )
        try:
            executive = core.Executive(
                fleet,
                journal,
                PluginManager(),
                SystemClock(self._speed),
                speed=self._speed,
                search_path=self._search_path,
                rehearse=_rehearse,
                foresee=outlook_in_subprocess,
                estimate=estimate_mission,
            )
        except PluginError as error:
            raise FleetError(f"{fleet.file}: {error}", ()) from error
        stack.callback(tidy_up, executive, file)
        # First, as nothing may come between connecting and taking up a run.
        await stack.enter_async_context(ControlSocket(executive.control, file))
        await stack.enter_async_context(executive)
        await stack.enter_async_context(LoopMonitor(executive.events, executive.health))
        return executive.control
