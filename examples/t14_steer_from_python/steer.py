"""Starts a mission, watches it, and pauses, resumes and signals it.

On a virtual clock: 150 seconds take none. With `asyncio.run(steer(SystemClock()))` they are real.
"""

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

from m2pem import load_fleet
from m2pem.api import ControlEvent, RunSummary, StampedRecord
from m2pem.api.clock import Clock, run_virtual
from m2pem.engine.records import Record
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet import simulated_fleet
from m2pem.journal import MemoryJournal
from m2pem.plugins import PluginManager

HERE = Path(__file__).parent
START_US = 1_767_225_600_000_000
"""2026-01-01T00:00:00Z"""

SHOWN = {
    *("RunStarted", "RunPaused", "RunResumed", "RunEnded"),
    *("BehaviorRequested", "BehaviorEnded", "SignalThrown"),
}


def line_of(record: Record) -> str:
    """Return the record's name and, if it has one, its element."""
    return f"{type(record).__name__} {getattr(record, 'element', '')}".rstrip()


async def watch(events: AsyncIterator[ControlEvent]) -> None:
    """Print records as they are committed, until the executive ends."""
    async for event in events:
        if isinstance(event, StampedRecord) and type(event.record).__name__ in SHOWN:
            print(f"{event.t_s:6.1f} s  {line_of(event.record)}")


async def steer(clock: Clock) -> RunSummary:
    """Start a patrol, pause it for a minute, and call it home."""
    fleet = simulated_fleet(load_fleet(HERE / "fleet.yaml"))
    async with Executive(fleet, MemoryJournal(), PluginManager(), clock) as executive:
        control = executive.control
        watching = asyncio.create_task(watch(control.subscribe()))
        run = await control.start(HERE / "mission.bpmn", by="steer.py")
        await clock.sleep(30)
        await control.pause(run, by="steer.py")
        await clock.sleep(60)
        await control.resume(run, by="steer.py")
        await clock.sleep(30)
        await control.signal("Come home", run=run, by="steer.py")
        summary = await control.wait(run)
    await watching
    return summary


def main() -> None:
    """Steer one run and print how it ended."""
    summary = run_virtual(steer, START_US)
    seconds = ((summary.ended_us or 0) - summary.started_us) / 1_000_000
    print(f"{summary.run} {summary.status}, {seconds:.1f} s after its start by the clock")


if __name__ == "__main__":
    main()
