"""Deleting runs that ended long ago, and what is kept of them beside the journal."""

import asyncio
from dataclasses import replace

import pytest

from m2pem.api.clock import run_virtual
from m2pem.engine.records import RunEnded, RunOutcome, RunStarted
from m2pem.executive.retention import DAY_S, delete_old_runs, delete_runs, keep_runs
from m2pem.executive.runtime_directory import runtime_directory
from m2pem.journal import MemoryJournal
from m2pem.journal.sqlite import SqliteJournal
from m2pem.testing.contracts.journal_harness import ENDED, HEADER, entry, opened

START_US = HEADER.created_us
DAY_US = round(DAY_S * 1_000_000)


async def with_run(journal, *records, driven=False, at_us=START_US + 1):
    run = await journal.create(HEADER)
    await journal.append([replace(entry(run, 1, *records), at_us=at_us)])
    if not driven:
        await journal.release(run)
    return run


async def ids(journal):
    return [line.run for line in await journal.runs()]


async def test_what_is_kept_of_a_deleted_run_goes_with_it(tmp_path, monkeypatch):
    monkeypatch.setenv("M2PEM_RUNTIME_DIR", str(tmp_path / "runtime"))
    path = tmp_path / "journal.db"
    async with opened(lambda: SqliteJournal.open(path)) as journal:
        await with_run(journal, *ENDED)
        await with_run(journal, *ENDED)
        tracks = tmp_path / "journal.db-tracks"
        tracks.mkdir()
        replays = tmp_path / "journal.db-replays"
        replays.mkdir()
        recordings = tmp_path / "journal.db-recordings"
        recordings.mkdir()
        kept, gone = (
            [
                tracks / f"{run}.jsonl",
                tracks / f"{run}-1.jpg",
                replays / f"{run}.index",
                recordings / f"{run}-20261126-160312.mcap",
                recordings / f"{run}-20261126-160312.2.mcap",
                tmp_path / f"journal.db-stopped-{run}",
                runtime_directory() / f"{journal.identity}-stopped-{run}",
            ]
            for run in ("r1", "r2")
        )
        for file in (*kept, *gone):
            file.touch()
        await delete_runs(journal, ["r2"], by="ann")
        assert [file.exists() for file in gone] == [False] * 7
        assert [file.exists() for file in kept] == [True] * 7


async def test_only_runs_that_ended_before_are_deleted():
    journal = MemoryJournal()
    await with_run(journal, *ENDED)
    await with_run(journal, RunStarted("PATROL", 5))
    await with_run(journal, *ENDED, driven=True)
    assert await delete_old_runs(journal, 10.0, START_US, START_US + 10_000_001, by="ann") == []
    assert await delete_old_runs(journal, 10.0, START_US, START_US + 10_000_002, by="ann") == ["r1"]
    assert await ids(journal) == ["r2", "r3"]
    assert [(each.run, each.by) for each in await journal.deletions()] == [("r1", "ann")]


def test_old_runs_are_deleted_at_the_start_and_each_day(caplog):
    seen = []

    async def main(clock):
        journal = MemoryJournal()
        await with_run(journal, *ENDED)
        keeping = asyncio.create_task(keep_runs(journal, 1.5 * DAY_S, clock, by="ann"))
        await clock.sleep(DAY_S / 2)
        for _ in range(3):
            seen.append(await ids(journal))
            await clock.sleep(DAY_S)
        keeping.cancel()

    run_virtual(main, START_US)
    assert seen == [["r1"], ["r1"], []]
    assert caplog.messages == ["deleted what ended longer ago than is kept: r1"]


@pytest.mark.parametrize("outcome", RunOutcome)
async def test_runs_of_every_outcome_are_deleted(outcome):
    journal = MemoryJournal()
    await with_run(journal, RunStarted("PATROL", 5), RunEnded(outcome, ""))
    assert await delete_old_runs(journal, 1.0, START_US, START_US + DAY_US, by="ann") == ["r1"]


async def test_a_clock_that_is_years_ahead_deletes_nothing_young(caplog):
    journal = MemoryJournal()
    await with_run(journal, *ENDED)
    ahead_us = START_US + 14 * 365 * DAY_US

    async def deleted(days):
        now_us = ahead_us + days * DAY_US
        return await delete_old_runs(journal, 30 * DAY_S, ahead_us, now_us, by="ann")

    assert await deleted(0) == []
    assert caplog.messages[-1].startswith(
        "kept: r1. By the clock, which shows 2039-12-29 00:00 UTC, they ended longer ago than is"
    )
    await with_run(journal, *ENDED, at_us=ahead_us + 1)
    assert await deleted(14) == []
    assert await deleted(16) == ["r1"]
    assert await deleted(31) == ["r2"]


async def test_runs_of_a_journal_that_is_seldom_used_are_deleted_in_the_end():
    journal = MemoryJournal()
    for days in (0, 90, 180, 270):
        await with_run(journal, *ENDED, at_us=START_US + days * DAY_US)
    now_us = START_US + 271 * DAY_US
    assert await delete_old_runs(journal, 30 * DAY_S, now_us, now_us, by="ann") == ["r1", "r2"]
