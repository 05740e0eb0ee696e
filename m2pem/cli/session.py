"""A session of one executive at the command line: its output, operator units, signals and files."""

import asyncio
import logging
import os
import shlex
import sys
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import asynccontextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from m2pem.api.clock import SystemClock
from m2pem.api.estimates import MissionEstimate
from m2pem.api.requirement_states import requirements_of
from m2pem.api.runs import FACE, Alert, RunId, RunStatus, SimulationResult
from m2pem.cli.group import STOPPED, ignore_closed_stdout, log_from_a_thread
from m2pem.cli.interruption import Interruption
from m2pem.cli.journals import url_of
from m2pem.cli.notes import note
from m2pem.cli.ocus import PLAIN, Operators
from m2pem.cli.options import UnusableError
from m2pem.cli.output import Output
from m2pem.cli.standard_streams import writer_for
from m2pem.control_socket.paths import live_sockets
from m2pem.control_socket.server import ControlSocket
from m2pem.errors import PluginError
from m2pem.executive.executive import Executive
from m2pem.executive.outlook_worker import outlook_in_subprocess
from m2pem.executive.process_monitors import LeaveToStandby, LoopMonitor
from m2pem.fleet.fleet import Fleet, real_resources
from m2pem.journal import file_of
from m2pem.journal.base import Journal
from m2pem.mission.mission import Mission
from m2pem.plugins import PluginManager, Plugins

if TYPE_CHECKING:
    from m2pem.cli.faces import Faces
    from m2pem.rehearsal.answers import Answers

log = logging.getLogger("m2pem.cli")

BACKLOG = 1_000_000
"""The maximum number of records that wait to be printed."""

PRINTING_S = 1.0
"""What the last lines of a process are given to be printed."""

EXIT_STATUS = {
    RunStatus.COMPLETED: 0,
    RunStatus.TERMINATED: 0,
    RunStatus.FAILED: 1,
    RunStatus.STOPPED: STOPPED,
}


@asynccontextmanager
async def driving(
    executive: Executive,
    output: Output,
    operators: Operators,
    journal: Path | None,
    interruption: Interruption,
    *,
    one: bool,
    faces: "Faces | None" = None,
) -> AsyncIterator[None]:
    """Connect, print and serve within the block; at its end, stop what still runs and close.

    `journal`: its file, beside which other processes find the executive. `interruption`: stops its
    runs. `one`: the command is about one run, not several.
    """

    def mission(run: RunId) -> Mission | None:
        runner = executive.runners.get(run)
        return runner.run.state.mission if runner is not None else None

    log_from_a_thread()
    output.format_with(mission, one=one, asks=PLAIN not in operators.names)
    loop = asyncio.get_running_loop()
    interruption.executive = executive

    def stop_output() -> None:
        loop.call_soon_threadsafe(interruption.stop, "the reader of its output has ended")

    output.writer.when_broken(stop_output)
    end = partial(interruption.end_at_once, status=1)
    leave = LeaveToStandby(executive.journal, executive.fleet.name, end)
    # First, as nothing may come between connecting and taking up a run: reports would be lost.
    async with (
        ControlSocket(executive.control, journal),
        executive,
        LoopMonitor(executive.events, executive.health, leave),
    ):
        notices = executive.control.subscribe(size=BACKLOG)
        printing = asyncio.create_task(output.follow(notices))
        if operators.take_terminal:
            interruption.take_terminal()
            output.cover()

        superseded = asyncio.create_task(executive.superseded.wait())
        superseded.add_done_callback(
            lambda task: (
                None
                if task.cancelled()
                else interruption.stop("another executive serves the fleet")
            )
        )

        def left() -> None:
            output.uncover()
            running = [key for key, each in executive.runners.items() if not each.done.is_set()]
            if running or not one:
                here = ("Ctrl-C here stops everything",)
                note(what_goes_on(running, journal, here, serves=not one))

        try:
            operators.begin(executive.control, left)
            if faces is not None:
                faces.begin(lambda text: executive.events.publish(Alert("", FACE, text)))
            yield
        finally:
            superseded.cancel()
            if faces is not None:
                try:  # a recorder has the ends of all runs
                    await executive.stop_all("the executive is shutting down")
                finally:
                    await faces.end()
            await operators.end()
            output.uncover()
    await printing
    await output.drain()
    await asyncio.to_thread(writer_for(sys.stderr).drain, PRINTING_S)
    if output.writer.broken:
        ignore_closed_stdout()


def what_goes_on(
    running: Sequence[RunId], journal: Path | None, how: Sequence[str] = (), *, serves: bool
) -> str:
    """Say what goes on when the operator of this terminal has left, and how to see and stop it.

    `running`: the runs that have not ended. `journal`: its file, None: no other command finds the
    executive. `how`: what else can be done. `serves`: whether it goes on without a run.
    """
    runs = f"missions go on: {', '.join(running)}" if running else "no mission runs"
    what = f"serving goes on; {runs}" if serves else runs
    can = []
    if journal is not None:
        option = (
            "" if journal == file_of(url_of(None)) else f" --journal {shlex.quote(str(journal))}"
        )
        can = [f"`m2pem attach{option}` shows it"]
        if serves:
            can.append(f"`m2pem start MISSION{option}` starts a mission")
        can += [f"`m2pem stop {run}{option}` stops {run}" for run in running[:1]]
    return f"m2pem: no operator at this terminal any more; {what}. {', '.join([*can, *how])}"


async def drive_run(
    executive: Executive,
    output: Output,
    operators: Operators,
    answers: "Answers | None",
    journal: Path | None,
    interruption: Interruption,
    begin: Callable[[], Awaitable[RunId]],
    faces: "Faces | None" = None,
) -> int:
    """Begin a run, see it to its end, and return the exit status.

    Runs that operators start beside it are seen to their ends, too.

    Raises:
        M2pemError: it cannot begin, or its executive can drive it no further.
    """
    async with driving(executive, output, operators, journal, interruption, one=True, faces=faces):
        if interruption.asked.is_set():
            return STOPPED
        run = await begin()
        if interruption.asked.is_set():
            await executive.stop_all("stopped while it began")
        acting = asyncio.create_task(_act(answers, executive, run))
        try:
            summary = await executive.control.wait(run)
            while others := [
                key for key, each in executive.runners.items() if not each.done.is_set()
            ]:
                await executive.control.wait(others[0])
        finally:
            acting.cancel()
    judged = requirements_of(executive.runner(run).run.state)
    output.summarize(run, judged.values())
    await output.drain()
    return EXIT_STATUS[summary.status]


async def _act(answers: "Answers | None", executive: Executive, run: RunId) -> None:
    if answers is None:
        return
    try:
        await answers.act(executive.control, run, executive.clock, default_first_decision=False)
    except Exception:
        log.exception("the answers file broke off; the mission goes on without it")


def refuse_speed(fleet: Fleet, speed: float) -> None:
    """Refuse a speed for real vehicles.

    Raises:
        UsageError: the fleet has real vehicles, and the speed is not 1.
    """
    if speed != 1.0 and (real := real_resources(fleet)):
        raise click.UsageError(
            f"--speed {speed:g}: {', '.join(real)} of {fleet.file} would be real; add --simulate, "
            "or mark what is software in the loop with `sitl: true`"
        )


def make_executive(
    fleet: Fleet,
    journal: Journal,
    plugins: PluginManager,
    clock: SystemClock,
    *,
    answers: "Answers | None" = None,
    search_path: Sequence[Path] = (),
    page: str = "",
) -> Executive:
    """An executive that has not connected yet. `page`: the address of its web page.

    Raises:
        UnusableError: the fleet names an arbiter that no plugin provides.
    """
    try:
        return Executive(
            fleet,
            journal,
            plugins if answers is None else _scripted(plugins, answers),
            clock,
            speed=clock.speed,
            search_path=search_path,
            on_records=None if answers is None else answers.seen,
            rehearse=_rehearse,
            foresee=outlook_in_subprocess,
            estimate=_estimate,
            has_others=partial(_others_on, journal.file),
            page=page,
        )
    except PluginError as error:
        raise UnusableError(f"{fleet.file}: {error}") from error


def _others_on(journal: Path | None) -> bool:
    """Whether executives of other processes are on a journal; it blocks."""
    if journal is None:
        return False
    return any(path.stem != str(os.getpid()) for path in live_sockets(journal))


def _scripted(plugins: PluginManager, answers: "Answers") -> Plugins:
    from m2pem.rehearsal.scripted import ScriptedPlugins

    return ScriptedPlugins(plugins, answers)


def _estimate(mission: Mission, fleet: Fleet, process: str | None) -> MissionEstimate:
    from m2pem.simulation.estimates import estimate_mission

    return estimate_mission(mission, fleet, process)


async def _rehearse(*arguments: Any, **options: Any) -> SimulationResult:
    from m2pem.rehearsal.worker import rehearse_in_subprocess

    return await rehearse_in_subprocess(*arguments, **options)
