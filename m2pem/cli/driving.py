"""One executive at a command line: it prints what happens, serves operators, heeds signals."""

import asyncio
import logging
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from m2pem.api.control import RunId, RunStatus
from m2pem.cli.entry import STOPPED, ignore_closed_stdout
from m2pem.cli.group import log_from_a_thread
from m2pem.cli.interruption import Interruption
from m2pem.cli.ocus import PLAIN, Operators
from m2pem.cli.output import Output
from m2pem.control_socket.server import ControlSocket
from m2pem.executive.executive import Executive
from m2pem.executive.loop_monitor import LoopMonitor
from m2pem.mission.mission import Mission

if TYPE_CHECKING:
    from m2pem.rehearsal.answers import Answers

log = logging.getLogger("m2pem.cli")

BACKLOG = 1_000_000
"""Records that may wait to be printed before printing is given up."""

EXIT_STATUS = {
    RunStatus.COMPLETED: 0,
    RunStatus.TERMINATED: 0,
    RunStatus.FAILED: 1,
    RunStatus.STOPPED: STOPPED,
}


@asynccontextmanager
async def driving(
    executive: Executive, output: Output, operators: Operators, journal: Path | None, *, one: bool
) -> AsyncIterator[Interruption]:
    """Connect, print and serve within the block; at its end, stop what still runs and close.

    `journal`: its file, beside which other processes find the executive. `one`: there is one run
    that matters, or several.
    """

    def mission(run: RunId) -> Mission | None:
        runner = executive.runners.get(run)
        return runner.run.state.mission if runner is not None else None

    log_from_a_thread()
    output.tell_by(mission, one=one, asks=PLAIN not in operators.names)
    loop = asyncio.get_running_loop()
    with Interruption(executive) as interruption:

        def nobody_reads() -> None:
            loop.call_soon_threadsafe(interruption.stop, "nobody reads its output any more")

        output.writer.when_broken(nobody_reads)
        # First, as nothing may come between connecting and taking up a run: reports would be lost.
        async with (
            ControlSocket(executive.control, journal),
            executive,
            LoopMonitor(executive.notices),
        ):
            notices = executive.control.subscribe(size=BACKLOG)
            printing = asyncio.create_task(output.follow(notices))
            if operators.take_terminal:
                output.cover()

            def left() -> None:
                output.uncover()
                if any(not each.done.is_set() for each in executive.runners.values()):
                    click.echo(
                        "m2pem: no operator at this terminal any more; missions go on "
                        "(m2pem attach), and Ctrl-C stops them",
                        err=True,
                    )

            try:
                operators.begin(executive.control, left)
                yield interruption
            finally:
                await operators.end()
                output.uncover()
        await printing
        await output.drain()
    if output.writer.broken:
        ignore_closed_stdout()


async def drive_run(
    executive: Executive,
    output: Output,
    operators: Operators,
    answers: "Answers | None",
    journal: Path | None,
    begin: Callable[[], Awaitable[RunId]],
) -> int:
    """Begin a run, see it to its end, and return the exit status.

    Runs that operators start beside it are seen to their ends, too.

    Raises:
        M2pemError: it cannot begin, or its executive can drive it no further.
    """
    async with driving(executive, output, operators, journal, one=True) as interruption:
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
    return EXIT_STATUS[summary.status]


async def _act(answers: "Answers | None", executive: Executive, run: RunId) -> None:
    if answers is None:
        return
    try:
        await answers.act(executive.control, run, executive.clock, default_first_decision=False)
    except Exception:
        log.exception("the answers file broke off; the mission goes on without it")
