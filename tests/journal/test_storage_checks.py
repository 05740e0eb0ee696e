"""Too little free space where the journal is."""

import pytest

from m2pem.errors import JournalError
from m2pem.journal.sqlite import SqliteJournal
from m2pem.journal.storage_checks import MIN_FREE_VARIABLE, min_free_mb, space_shortage
from m2pem.testing.contracts.journal_harness import HEADER, entry, info, opened

MORE_THAN_ANY_DISK_MB = "1e15"


@pytest.fixture
def open_journal(tmp_path):
    return lambda: SqliteJournal.open(tmp_path / "journal.db")


async def test_no_run_begins_below_the_bound_and_those_that_run_go_on(open_journal, monkeypatch):
    async with opened(open_journal) as journal:
        run = await journal.create(HEADER)
        monkeypatch.setenv(MIN_FREE_VARIABLE, MORE_THAN_ANY_DISK_MB)
        with pytest.raises(JournalError, match=r"MB are free where .* no run begins. Make room"):
            await journal.create(HEADER)
        await journal.append([entry(run, 1)])
        assert (await info(journal, run)).last_seq == 1
        monkeypatch.setenv(MIN_FREE_VARIABLE, "0")
        assert await journal.create(HEADER) == "r2"


def test_the_bound_is_200_mb_unless_said_otherwise(tmp_path, monkeypatch):
    monkeypatch.delenv(MIN_FREE_VARIABLE, raising=False)
    assert min_free_mb() == 200
    monkeypatch.setenv(MIN_FREE_VARIABLE, "0")
    assert space_shortage(tmp_path / "journal.db") == ""


@pytest.mark.parametrize("text", ["much", "-1", "nan", "inf"])
def test_a_bound_that_is_none_is_refused_when_the_journal_is_opened(
    open_journal, monkeypatch, text
):
    monkeypatch.setenv(MIN_FREE_VARIABLE, text)
    with pytest.raises(
        JournalError, match=rf"{MIN_FREE_VARIABLE}={text} is not a number of megabytes"
    ):
        open_journal()
