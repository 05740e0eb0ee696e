"""Operators are warned while the disk of the journal has little free space; a blocked executive
leaves its missions to a standby."""

import asyncio
import threading
from pathlib import Path

import pytest

from m2pem.api.runs import Alert
from m2pem.executive import process_monitors as space
from m2pem.executive.control_events import ControlEvents
from m2pem.executive.health import ExecutiveHealth
from m2pem.executive.process_monitors import LeaveToStandby, LoopMonitor, watch_space
from m2pem.journal import MemoryJournal
from m2pem.journal.fleet_server import FleetServer
from m2pem.journal.storage_checks import MIN_FREE_VARIABLE


async def test_operators_are_warned_when_space_runs_short_and_when_there_is_room_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(space, "EVERY_S", 0.0)
    monkeypatch.setenv(MIN_FREE_VARIABLE, "1e15")
    notices = ControlEvents()
    subscription = notices.subscribe(None, 10)
    watching = asyncio.create_task(watch_space(tmp_path / "journal.db", notices))
    warning = await anext(subscription)
    assert isinstance(warning, Alert)
    assert (warning.run, warning.code) == ("", "JOURNAL_SPACE")
    assert "no run begins. Make room" in warning.text
    monkeypatch.setenv(MIN_FREE_VARIABLE, "0")
    while not isinstance(again := await anext(subscription), Alert) or "room again" not in (
        again.text
    ):
        assert "Make room" in getattr(again, "text", "")
    watching.cancel()


class WithStandby(MemoryJournal):
    """An executive stands by for the fleet when the journal is asked for the second time."""

    lease_s = 0.1
    asked = 0

    def abandon(self, fleet: str) -> FleetServer | None:
        self.asked += 1
        return FleetServer("gcs2", 7, "m2pem serve --standby") if self.asked == 2 else None


async def test_a_blocked_executive_ends_as_soon_as_another_one_stands_by() -> None:
    journal, events, ended = WithStandby(), ControlEvents(), threading.Event()
    said: list[str] = []

    def end(why: str) -> None:
        said.append(why)
        ended.set()

    leave = LeaveToStandby(journal, "north", end)
    async with LoopMonitor(events, ExecutiveHealth(journal), leave):
        assert ended.wait(30)  # this blocks the loop
    assert "has blocked it for" in said[0]
    assert said[0].endswith("leaves its missions to process 7 on gcs2 (m2pem serve --standby)")
    assert journal.asked == 2
