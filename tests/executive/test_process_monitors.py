"""Operators are warned while the disk of the journal has little free space."""

import asyncio
from pathlib import Path

import pytest

from m2pem.api.runs import Alert
from m2pem.executive import process_monitors as space
from m2pem.executive.control_events import ControlEvents
from m2pem.executive.process_monitors import watch_space
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
