import asyncio
import tracemalloc

import pytest

from m2pem.engine.records import InputIgnored
from m2pem.errors import JournalError
from m2pem.journal.sqlite import SqliteJournal
from m2pem.testing.contracts.journal import HEADER, JournalContract, entry, line, opened, written


class TestSqliteJournal(JournalContract):
    @pytest.fixture
    def open_journal(self, tmp_path):
        return lambda: SqliteJournal.open(tmp_path / "journal.db")


@pytest.fixture
def open_journal(tmp_path):
    return lambda: SqliteJournal.open(tmp_path / "journal.db")


async def test_calls_that_wait_together_share_a_commit(open_journal):
    async with opened(open_journal) as journal:
        runs = [await journal.create(HEADER) for _ in range(100)]
        before = journal.commits
        for seq in range(1, 6):
            await asyncio.gather(*(journal.append([entry(run, seq)]) for run in runs))
        assert 5 <= journal.commits - before <= 25
        assert {found.last_seq for found in await journal.runs()} == {5}


async def test_an_append_alone_takes_one_commit_and_reading_none(open_journal):
    async with opened(open_journal) as journal:
        run = await journal.create(HEADER)
        before = journal.commits
        for seq in range(1, 6):
            await journal.append([entry(run, seq)])
        await written(journal, run)
        await journal.release(run)
        assert journal.commits - before == 5


async def test_a_group_larger_than_a_statement_is_written_whole(open_journal):
    async with opened(open_journal) as journal:
        runs = [await journal.create(HEADER) for _ in range(101)]
        some = [entry(run, seq) for run in runs for seq in (1, 2, 3)]
        before = journal.commits
        await journal.append(some)
        assert journal.commits - before == 1
        for run in runs:
            assert await written(journal, run) == [found for found in some if found.run == run]


async def test_reading_takes_memory_for_a_batch_not_for_the_run(open_journal):
    text = "x" * 100_000
    async with opened(open_journal) as journal:
        run = await journal.create(HEADER)
        for first in range(1, 300, 10):
            some = [entry(run, first + n, InputIgnored(f"{text}{first + n}")) for n in range(10)]
            await journal.append(some)
        del some
        tracemalloc.start()
        try:
            count = 0
            async for _ in journal.read(run):
                count += 1
            peak_bytes = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
        assert count == 300
        assert peak_bytes < 6_000_000


@pytest.mark.parametrize("act", ["create", "claim"])
async def test_a_cancelled_claim_is_not_held_for_ever(open_journal, act):
    async with opened(open_journal) as journal:
        run = await journal.create(HEADER)
        if act == "claim":
            await journal.release(run)
        call = asyncio.ensure_future(
            journal.create(HEADER) if act == "create" else journal.claim(run)
        )
        await asyncio.sleep(0)
        call.cancel()
        assert await asyncio.gather(call, return_exceptions=True) == [call_cancelled(call)]
        taken = (await journal.runs())[-1].run
        while (await line(journal, taken)).driven:
            # Each turn is a round trip through the reading thread.
            await journal.append([])
            taken = (await journal.runs())[-1].run
        assert await journal.claim(taken) >= 2


def call_cancelled(call):
    assert call.cancelled()
    return pytest.approx(asyncio.CancelledError()) if False else None
