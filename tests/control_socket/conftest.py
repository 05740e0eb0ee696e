"""An executive on the wall clock with a fake arbiter, and its socket beside a journal's path."""

from collections.abc import AsyncIterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from m2pem.api.clock import SystemClock
from m2pem.control_socket.server import ControlSocket
from m2pem.executive.control import Control
from m2pem.executive.executive import Executive
from m2pem.journal import MemoryJournal
from m2pem.telemetry.bus import Bus
from tests.executive.conftest import FakePlugins, Fakes, fleet, mission, question, sequence


@dataclass
class Served:
    """A served executive, and a mission that asks one question."""

    control: Control
    journal: Path
    path: Path
    bus: Bus

    async def asked(self) -> tuple[str, str]:
        """Start the mission; returns its run and its prompt, which stands."""
        notices = self.control.subscribe()
        run = await self.control.start(mission(sequence(("Ask", question("Ask")))))
        async for notice in notices:
            prompt = getattr(notice, "prompt", "")
            if prompt:
                return run, prompt
        raise AssertionError("the mission asked nothing")


@pytest.fixture
async def served(tmp_path: Path) -> AsyncIterator[Served]:
    journal = tmp_path / ("a_long_name_" * 10) / "j.db"
    journal.parent.mkdir()
    executive = Executive(
        fleet("v1"), MemoryJournal(), FakePlugins(Fakes(), []), SystemClock(), watch_links=False
    )
    async with executive, ControlSocket(executive.control, journal) as server:
        assert server.path is not None
        yield Served(executive.control, journal, server.path, executive.bus)
