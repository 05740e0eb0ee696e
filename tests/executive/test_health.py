"""What an executive says of itself: its journal, its arbiters, its event loop."""

import asyncio
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from m2pem.api.clock import SystemClock
from m2pem.api.health import HealthCheck, HealthStatus
from m2pem.errors import JournalError
from m2pem.executive import health as executive_health
from m2pem.executive.executive import Executive
from m2pem.executive.health import ExecutiveHealth
from m2pem.journal import MemoryJournal, open_journal
from m2pem.journal.storage_checks import MIN_FREE_VARIABLE
from m2pem.plugins import PluginManager
from m2pem.testing import scenarios
from m2pem.testing.fake_arbiter import FakeArbiter

OK, ERROR = HealthStatus.OK, HealthStatus.ERROR


async def checks_of(health: ExecutiveHealth) -> dict[str, HealthCheck]:
    return {check.name: check for check in await health.checks()}


@pytest.fixture(autouse=True)
def no_answer_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(executive_health, "FRESH_S", 0.0)


async def test_an_executive_is_well_between_connecting_and_closing() -> None:
    fleet = scenarios.fleet("sim", {"ugv1": {}})
    executive = Executive(fleet, MemoryJournal(), PluginManager(), SystemClock())
    before = {check.name: check.status for check in await executive.control.health()}
    async with executive:
        within = {check.name: check.status for check in await executive.control.health()}
    after = {check.name: check.status for check in await executive.control.health()}
    assert within == {"journal": OK, "arbiters": OK, "event loop": OK}
    assert before == after == {**within, "arbiters": ERROR}


async def test_an_arbiter_whose_reports_break_off_is_named() -> None:
    class Broken(FakeArbiter):
        async def reports(self):
            raise ValueError("no more reports")
            yield

    class Plugins(PluginManager):
        def arbiter(self, name):
            return Broken

    fleet = scenarios.fleet("sim", {"ugv1": {}})
    async with Executive(fleet, MemoryJournal(), Plugins(), SystemClock()) as executive:
        async with asyncio.timeout(10):
            while (await executive.control.health())[1].status is OK:  # noqa: ASYNC110
                await asyncio.sleep(0)
        arbiters = (await executive.control.health())[1]
    assert arbiters.message.startswith("broke off: reports of sim")


async def test_a_blocked_event_loop_is_an_error_for_some_seconds(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    health = ExecutiveHealth(MemoryJournal())
    health.blocked("a plugin blocked the executive")
    check = (await checks_of(health))["event loop"]
    assert (check.status, check.message) == (ERROR, "a plugin blocked the executive")
    monkeypatch.setattr(executive_health, "BLOCKED_FOR_S", 0.0)
    health.blocked("a plugin blocked the executive")
    assert (await checks_of(health))["event loop"].status is OK


async def test_a_journal_whose_file_was_removed_or_whose_disk_is_full_does_not_write(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "journal.db"
    journal = open_journal(str(path))
    health = ExecutiveHealth(journal)
    try:
        assert (await checks_of(health))["journal"].status is OK
        monkeypatch.setenv(MIN_FREE_VARIABLE, "1e15")
        assert "no run begins" in (await checks_of(health))["journal"].message
        monkeypatch.setenv(MIN_FREE_VARIABLE, "0")
        assert (await checks_of(health))["journal"].status is OK
        path.rename(tmp_path / "elsewhere.db")
        assert "was removed" in (await checks_of(health))["journal"].message
        (tmp_path / "elsewhere.db").rename(path)
        assert (await checks_of(health))["journal"].status is OK
    finally:
        await journal.close()


async def test_a_journal_that_another_program_has_locked_does_not_answer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(executive_health, "JOURNAL_WITHIN_S", 0.1)
    path = tmp_path / "journal.db"
    journal = open_journal(str(path))
    health = ExecutiveHealth(journal)
    try:
        with closing(sqlite3.connect(path, isolation_level=None)) as other:
            other.execute("BEGIN IMMEDIATE")
            check = (await checks_of(health))["journal"]
            assert check.status is ERROR
            assert "has not answered" in check.message
            other.execute("ROLLBACK")
        async with asyncio.timeout(30):
            while (await checks_of(health))["journal"].status is ERROR:
                pass
    finally:
        health.close()
        await journal.close()


class CountedJournal(MemoryJournal):
    """Counts how often it is asked; answers when `goes_on` is set."""

    def __init__(self) -> None:
        super().__init__()
        self.asked = 0
        self.goes_on = asyncio.Event()

    async def check(self) -> None:
        self.asked += 1
        await self.goes_on.wait()
        raise JournalError("the disk is full")


async def test_however_many_ask_the_journal_is_asked_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(executive_health, "FRESH_S", 60.0)
    monkeypatch.setattr(executive_health, "JOURNAL_WITHIN_S", 0.0)
    journal = CountedJournal()
    health = ExecutiveHealth(journal)
    for _ in range(100):
        assert "has not answered" in (await checks_of(health))["journal"].message
    journal.goes_on.set()
    monkeypatch.setattr(executive_health, "JOURNAL_WITHIN_S", 60.0)
    answers = await asyncio.gather(*(checks_of(health) for _ in range(100)))
    assert {each["journal"].message for each in answers} == {"the disk is full"}
    assert journal.asked == 1


async def test_a_closed_executive_asks_no_more() -> None:
    journal = CountedJournal()
    health = ExecutiveHealth(journal)
    asking = asyncio.create_task(checks_of(health))
    while not journal.asked:  # noqa: ASYNC110
        await asyncio.sleep(0)
    health.close()
    assert "has not answered" in (await asking)["journal"].message
