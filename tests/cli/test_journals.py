from pathlib import Path

import pytest

from m2pem.cli.journals import existing_journal, find_run, journal_at, last_decided_us
from m2pem.cli.options import UnusableError
from m2pem.engine.inputs import StartRun, Tick
from m2pem.engine.records import InputIgnored, Record, RunStarted
from m2pem.journal import MemoryJournal
from m2pem.journal.base import Entry, Journal, RunHeader

HEADER = RunHeader("a.bpmn", b"<definitions/>", "P", created_us=5)


async def written(journal: Journal, *sizes: int) -> str:
    """A run with an entry of so many records each, at 10, 20, 30, ... us."""
    run = await journal.create(HEADER)
    seq = 1
    for place, size in enumerate(sizes):
        records: tuple[Record, ...] = (InputIgnored("x"),) * size
        if place == 0:
            records = (RunStarted("P", 10), *records[1:])
        item = StartRun("P") if place == 0 else Tick()
        at_us = 10 * (place + 1)
        await journal.append([Entry(run, 1, seq, at_us, at_us, item, records)])
        seq += size
    return run


@pytest.mark.parametrize("sizes", [(1,), (1, 1, 1), (3, 50), (3, 1, 2000), (5000, 1), (4, 4, 4, 4)])
async def test_when_the_last_input_was_decided(sizes: tuple[int, ...]) -> None:
    journal = MemoryJournal()
    run = await written(journal, *sizes)
    line = await find_run(journal, run)
    assert await last_decided_us(journal, line) == 10 * len(sizes)


async def test_a_run_without_any_input_is_as_old_as_its_beginning() -> None:
    journal = MemoryJournal()
    run = await journal.create(HEADER)
    assert await last_decided_us(journal, await find_run(journal, run)) == 5


async def test_an_unknown_run_is_told_with_those_there_are() -> None:
    journal = MemoryJournal()
    with pytest.raises(UnusableError, match="no run 'r1'; it has none yet"):
        await find_run(journal, "r1")
    await written(journal, 1)
    with pytest.raises(UnusableError, match="no run 'r2'; it has r1"):
        await find_run(journal, "r2")


async def test_a_journal_is_made_where_it_is_to_be_written(tmp_path: Path) -> None:
    path = tmp_path / "journal.db"
    with pytest.raises(UnusableError):
        async with existing_journal(str(path)):
            pass
    async with journal_at(str(path)) as journal:
        await written(journal, 1)
    async with existing_journal(str(path)) as journal:
        assert [line.run for line in await journal.runs()] == ["r1"]


async def test_a_user_without_a_journal_has_an_empty_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    async with existing_journal(None) as journal:
        assert await journal.runs() == []
