import gc

import pytest

from m2pem.errors import JournalError
from m2pem.journal.base import Entry
from m2pem.journal.memory import MemoryJournal
from m2pem.testing.contracts.journal import JournalContract
from m2pem.testing.contracts.journal_harness import HEADER, entry, info, written


class TestMemoryJournal(JournalContract):
    unsupported = {  # noqa: RUF012
        "durability": "it ends with its process",
        "notification": "no other executive has it",
    }

    @pytest.fixture
    def open_journal(self):
        return MemoryJournal


async def filled(keep):
    journal = MemoryJournal(keep=keep)
    run = await journal.create(HEADER)
    for seq in range(1, 101):
        await journal.append([entry(run, seq)])
    return journal, run


@pytest.mark.parametrize("keep", [0, 1, 7, 99, 100, 1000])
async def test_keep_holds_the_last_entries_and_at_most_twice_as_many(keep):
    gc.collect()
    before = sum(isinstance(each, Entry) for each in gc.get_objects())
    journal, run = await filled(keep)
    assert (await info(journal, run)).last_seq == 100
    kept = [found.seq for found in await written(journal, run, max(0, 100 - keep))]
    assert kept == list(range(max(1, 101 - keep), 101))
    held = sum(isinstance(each, Entry) for each in gc.get_objects()) - before
    assert held <= max(2 * keep, 1)


async def test_reading_what_was_not_kept_is_refused_rather_than_left_out():
    journal, run = await filled(keep=10)
    with pytest.raises(JournalError, match=r"r1: only what comes after record \d+ was kept"):
        await written(journal, run)


def test_two_journals_are_told_apart():
    assert MemoryJournal().identity != MemoryJournal().identity


def test_nothing_belongs_beside_it() -> None:
    assert MemoryJournal().file is None
