"""A journal outlives its executive, however that ends, and serves several at once."""

import random
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

from m2pem.errors import JournalError
from m2pem.journal.sqlite import SqliteJournal
from m2pem.testing.contracts.journal_harness import HEADER, entry, info, opened, written


@contextmanager
def driving(path, runs):
    """A process that drives `runs` new runs of a journal, killed in the end."""
    command = [sys.executable, str(Path(__file__).with_name("driving.py")), str(path), str(runs)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as child:
        try:
            yield child
        finally:
            child.kill()


def durable(child, lines):
    """The last entry's number per run among the next lines that the process prints."""
    last = {}
    for _ in range(lines):
        run, seq = child.stdout.readline().split()
        last[run] = int(seq)
    return last


async def assert_whole(journal, run, up_to):
    entries = await written(journal, run)
    assert entries[-1].seq >= up_to
    expected = 1
    for found in entries:
        assert found.seq == expected
        assert len(found.records) == 1 + found.seq % 3
        for number, record in enumerate(found.records, found.seq):
            assert record.reason.rstrip("x") == str(number)
        expected += len(found.records)
    assert (await info(journal, run)).last_seq == expected - 1


async def kill_and_look(path, runs, lines):
    with driving(path, runs) as child:
        last = durable(child, lines)
        child.kill()
        rest, _ = child.communicate()
    for printed in rest.splitlines(keepends=True):
        if printed.endswith("\n"):
            run, seq = printed.split()
            last[run] = int(seq)
    async with opened(lambda: SqliteJournal.open(path)) as journal:
        assert last
        for run, seq in last.items():
            await assert_whole(journal, run, seq)
            assert not (await info(journal, run)).driven
            assert await journal.claim(run) == 2
            following = (await info(journal, run)).last_seq + 1
            await journal.append([entry(run, following, epoch=2)])


@pytest.mark.parametrize(("runs", "lines"), [(1, 1), (1, 50), (20, 333)])
async def test_nothing_durable_is_lost_when_the_executive_is_killed(tmp_path, runs, lines):
    await kill_and_look(tmp_path / "journal.db", runs, lines)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(50))
async def test_nothing_durable_is_lost_at_any_moment(tmp_path, seed):
    chance = random.Random(seed)
    await kill_and_look(tmp_path / "journal.db", chance.randint(1, 50), chance.randint(1, 5000))


async def test_a_run_of_a_living_process_cannot_be_taken_and_that_of_a_dead_one_can(tmp_path):
    path = tmp_path / "journal.db"
    async with opened(lambda: SqliteJournal.open(path)) as journal:
        with driving(path, 1) as child:
            durable(child, 3)
            assert (await info(journal, "r1")).driven
            with pytest.raises(JournalError, match=f"r1 is driven by process {child.pid}, which"):
                await journal.claim("r1")
            child.kill()
            child.wait()
            assert not (await info(journal, "r1")).driven
            assert await journal.claim("r1") == 2


async def test_two_executives_write_to_one_journal(tmp_path):
    path = tmp_path / "journal.db"
    async with opened(lambda: SqliteJournal.open(path)) as journal:
        mine = await journal.create(HEADER)
        with driving(path, 3) as child:
            last = durable(child, 30)
            for seq in range(1, 101):
                await journal.append([entry(mine, seq)])
            last |= durable(child, 30)
        assert [found.seq for found in await written(journal, mine)] == list(range(1, 101))
        for run, seq in last.items():
            await assert_whole(journal, run, seq)
