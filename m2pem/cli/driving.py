"""One executive at a command line: what it does is printed, operators are served, signals heeded."""

import asyncio
from collections.abc import AsyncIterator, Iterable
from contextlib import asynccontextmanager
from pathlib import Path

from m2pem.api.control import MissionControl, RunId, RunStatus, RunSummary
from m2pem.cli.entry import STOPPED, ignore_closed_stdout
from m2pem.cli.interruption import Interruption
from m2pem.cli.ocus import Operators
from m2pem.cli.output import Output
from m2pem.executive.executive import Executive
from m2pem.model.elements import Mission

BACKLOG = 1_000_000
"""Records that may wait to be printed before printing is given up."""

EXIT_STATUS = {
    RunStatus.COMPLETED: 0,
    RunStatus.TERMINATED: 0,
    RunStatus.FAILED: 1,
    RunStatus.STOPPED: STOPPED,
}


class Driving:
    """What a command does with its executive while it is open; made by `driving`."""

    def __init__(self, executive: Executive, output: Output, interruption: Interruption) -> None:
        self.executive = executive
        self.control: MissionControl = executive.control
        self.interruption = interruption
        self.output = output

    async def until_all_ended(self, main: RunId) -> RunSummary:
        """Wait for a run, and for those that operators started beside it."""
        summary = await self.control.wait(main)
        while others := [run for run, each in self.executive.runners.items() if not each.done.is_set()]:
            await self.control.wait(others[0])
        return summary


@asynccontextmanager
async def driving(
    executive: Executive, output: Output, operators: Operators
) -> AsyncIterator[Driving]:
    """Connect, print and serve within the block; at its end, stop what still runs and close."""

    def mission(run: RunId) -> Mission | None:
        runner = executive.runners.get(run)
        return runner.run.state.mission if runner is not None else None

    output.about(mission)
    loop = asyncio.get_running_loop()
    with Interruption(executive) as interruption:

        def nobody_reads() -> None:
            loop.call_soon_threadsafe(interruption.stop, "nobody reads its output any more")

        output.writer.when_broken(nobody_reads)
        async with executive:
            notices = executive.control.subscribe(size=BACKLOG)
            printing = asyncio.create_task(output.follow(notices))
            operators.begin(executive.control)
            try:
                yield Driving(executive, output, interruption)
            finally:
                await operators.end()
        await printing
        await output.drain()
    if output.writer.broken:
        ignore_closed_stdout()


def remove_states(paths: Iterable[str]) -> None:
    """Delete the files of simulated vehicles that nobody will take up again."""
    for path in paths:
        for name in (path, f"{path}-wal", f"{path}-shm"):
            Path(name).unlink(missing_ok=True)
