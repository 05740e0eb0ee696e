"""Copies of a journal that are made while its executive runs."""

import asyncio
import logging

import pytest

from m2pem.api.clock import run_virtual
from m2pem.errors import JournalError
from m2pem.executive import backups
from m2pem.executive.backups import add_backup, keep_backups
from m2pem.journal.sqlite import SqliteJournal
from m2pem.testing.contracts.journal_harness import HEADER, entry, info, opened, written


async def test_a_copy_of_a_journal_in_use_has_what_was_acknowledged(tmp_path):
    async with opened(lambda: SqliteJournal.open(tmp_path / "journal.db")) as journal:
        run = await journal.create(HEADER)
        await journal.append([entry(run, 1)])
        (tmp_path / "copies").mkdir()
        copy = await asyncio.to_thread(add_backup, tmp_path / "journal.db", tmp_path / "copies")
        await journal.append([entry(run, 2)])
    async with opened(lambda: SqliteJournal.open(copy)) as journal:
        assert [each.seq for each in await written(journal, run)] == [1]
        assert (await info(journal, run)).loss is None
    for each in ("-wal", "-shm"):
        (tmp_path / f"journal.db{each}").unlink(missing_ok=True)
    copy.replace(tmp_path / "journal.db")  # without its mark (docs/journal.md)
    async with opened(lambda: SqliteJournal.open(tmp_path / "journal.db")) as journal:
        loss = (await info(journal, run)).loss
        assert (loss.acknowledged, loss.found) == (2, 1)


async def test_the_newest_copies_stay_and_other_files_too(tmp_path, monkeypatch):
    monkeypatch.setattr(backups, "KEPT", 2)
    await SqliteJournal.open(tmp_path / "journal.db").close()
    folder = tmp_path / "copies"
    folder.mkdir()
    (folder / "journal-29991231T000000.000000Z.db").touch()  # while the clock was ahead
    for other in ("journal-monday.db", "other-20260101T000000.000000Z.db"):
        (folder / other).touch()
    (folder / "journal.db-unfinished").touch()  # by a crash
    made = [add_backup(tmp_path / "journal.db", folder) for _ in range(3)]
    expected = {"journal-monday.db", "other-20260101T000000.000000Z.db"}
    expected |= {f"{each.name}{mark}" for each in made[1:] for mark in ("", "-mark")}
    assert {each.name for each in folder.iterdir()} == expected


async def test_a_copy_that_would_fill_the_disk_is_not_begun(tmp_path, monkeypatch):
    await SqliteJournal.open(tmp_path / "journal.db").close()
    (tmp_path / "copies").mkdir()
    monkeypatch.setenv("M2PEM_MIN_FREE_MB", "1e12")
    with pytest.raises(JournalError, match=r"MB are free in .*copies; .* are needed"):
        add_backup(tmp_path / "journal.db", tmp_path / "copies")
    assert list((tmp_path / "copies").iterdir()) == []


def test_operators_are_told_of_what_fails_and_it_is_tried_again(tmp_path, caplog):
    folder = tmp_path / "copies"

    async def make():
        await SqliteJournal.open(tmp_path / "journal.db").close()

    async def main(clock):
        keeping = asyncio.create_task(keep_backups(tmp_path / "journal.db", folder, 60.0, clock))
        await clock.sleep(59.0)
        folder.mkdir()
        await clock.sleep(2.0)
        keeping.cancel()
        return len(list(folder.glob("journal-*.db")))

    asyncio.run(make())
    with caplog.at_level(logging.WARNING, "m2pem.executive"):
        assert run_virtual(main, 0) == 1
    assert f"the journal is not backed up: {folder}: No such file" in caplog.text
