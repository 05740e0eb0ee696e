"""What is intact in a damaged journal: it is named, and copied to a new one that can be used."""

import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from functools import partial
from pathlib import Path

import pytest

from m2pem.engine.records import InputIgnored, Record
from m2pem.errors import JournalError
from m2pem.journal.inspection import Inspection, inspected
from m2pem.journal.salvage import salvage
from m2pem.journal.sqlite import SqliteJournal
from m2pem.scheduling.entry import EntryState
from m2pem.testing.contracts.journal_harness import (
    ENDED,
    HEADER,
    PLAN,
    entry,
    info,
    opened,
    written,
)
from tests.journal.test_damage import copied, kill_executive

RUNS = 3
ENTRIES = 12
SUFFIXES = ("", "-wal", "-mark")


def look(path: Path) -> Inspection:
    with inspected(path) as (_, found):
        return found


async def fill(path: Path) -> None:
    """r1 has ended, r2 and r3 have not; some of their records are longer than a page."""
    async with opened(lambda: SqliteJournal.open(path)) as journal:
        for _ in range(RUNS):
            run = await journal.create(HEADER)
            for seq in range(1, ENTRIES + 1):
                await journal.append([entry(run, seq, *_records(run, seq))])
        await journal.schedule(PLAN, EntryState(settled_us=1))


def _records(run: str, seq: int) -> tuple[Record, ...]:
    if run == "r1" and seq == ENTRIES:
        return (ENDED[1],)
    return (InputIgnored(f"{run} nr {seq} " + "x" * (9000 if seq % 4 == 0 else 1)),)


@pytest.fixture
async def path(tmp_path: Path) -> Path:
    made = tmp_path / "journal.db"
    await fill(made)
    return made


def change(path: Path, statement: str) -> None:
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute(statement)


def content(path: Path) -> dict[str, bytes]:
    """What is in a journal's files. SQLite may leave an empty log."""
    files = {what: path.with_name(path.name + what) for what in SUFFIXES}
    found = {what: file.read_bytes() for what, file in files.items() if file.exists()}
    return {what: content for what, content in found.items() if content}


async def test_a_whole_journal_is_said_to_be(path: Path) -> None:
    found = look(path)
    assert found.whole
    assert [(run.run, run.entries, run.position.last_seq) for run in found.runs] == [
        (f"r{number}", ENTRIES, ENTRIES) for number in range(1, RUNS + 1)
    ]
    assert len(found.schedule) == 1


async def test_what_an_executive_writes_is_seen_while_it_writes(path: Path) -> None:
    async with opened(lambda: SqliteJournal.open(path)) as journal:
        run = await journal.create(HEADER)
        await journal.append([entry(run, 1)])
        found = look(path)
        assert found.whole
        assert found.runs[-1].position.last_seq == 1
        await journal.append([entry(run, 2)])


DAMAGES = {
    "body": ("UPDATE entries SET body = replace(body, 'nr 5', 'nr 6') WHERE run = 2 AND seq = 5",
             "records 1 to 4 are intact; record 5: it does not follow from what was before it",
             4, 8),
    "missing": ("DELETE FROM entries WHERE run = 2 AND seq = 5",
                "records 1 to 4 are intact; record 5: it is missing", 4, 7),
    "tail": ("DELETE FROM entries WHERE run = 2 AND seq > 9",
             "records 1 to 9 are intact; record 10 is missing", 9, 0),
    "standing": ("DELETE FROM standings WHERE run = 2",
                 "records 1 to 12 are intact; its row in the table `standings` is missing", 12, 0),
    "header": ("UPDATE runs SET library = 'x' WHERE run = 2",
               "no record is intact; its mission and fleet are missing or damaged", 0, 12),
}  # fmt: skip


@pytest.mark.parametrize("damage", DAMAGES)
async def test_the_damage_of_a_run_is_named_and_the_rest_of_it_salvaged(
    path: Path, tmp_path: Path, damage: str
) -> None:
    statement, problem, intact, unusable = DAMAGES[damage]
    change(path, statement)
    before = content(path)
    found = look(path)
    (wrong,) = [run for run in found.runs if run.problem]
    assert wrong.run == "r2"
    assert wrong.problem.startswith(problem)
    assert (wrong.position.last_seq, wrong.unusable) == (intact, unusable)
    target = tmp_path / "new.db"
    salvage(path, target, "anna")
    assert content(path) == before
    async with opened(lambda: SqliteJournal.open(target)) as journal:
        lines = {line.run: line for line in await journal.runs()}
        assert (lines["r1"].loss, lines["r1"].outcome) == (None, "completed")
        loss = lines["r2"].loss
        assert loss is not None
        assert (loss.acknowledged, loss.found or 0) == (ENTRIES, intact)
        if intact:
            assert len(await written(journal, "r2")) == intact
        with pytest.raises(JournalError, match="no run begins: r2"):
            await journal.create(HEADER)


async def test_a_run_that_had_not_ended_asks_before_it_goes_on(path: Path, tmp_path: Path) -> None:
    target = tmp_path / "new.db"
    assert salvage(path, target, "anna").whole
    async with opened(lambda: SqliteJournal.open(path)) as journal:
        identity, entries = journal.identity, await written(journal, "r2")
    async with opened(lambda: SqliteJournal.open(target)) as journal:
        assert journal.identity != identity
        loss = (await info(journal, "r2")).loss
        assert loss is not None and loss.resumable
        assert "was salvaged from another journal, which acknowledged record 12" in str(loss)
        assert await written(journal, "r2") == entries
        epoch = await journal.claim("r2")
        assert epoch > entries[-1].epoch
        assert (await info(journal, "r2")).loss == loss
        await journal.append([entry("r2", ENTRIES + 1, epoch=epoch)])
        assert (await info(journal, "r2")).loss is None
    with closing(sqlite3.connect(target)) as connection:
        (origin,) = connection.execute("SELECT path, uuid, salvaged_by FROM origin")
        assert origin == (str(path), str(identity), "anna")


async def test_the_schedule_is_salvaged_and_held(path: Path, tmp_path: Path) -> None:
    target = tmp_path / "new.db"
    salvage(path, target, "anna")
    async with opened(lambda: SqliteJournal.open(target)) as journal:
        (kept,) = await journal.entries()
        assert kept.plan == PLAN
        hold = await journal.schedule_hold(PLAN.fleet)
        assert hold is not None
        assert hold.reason == f"salvaged from {path}"


async def test_alerts_and_drawings_are_salvaged(path: Path, tmp_path: Path) -> None:
    alerts = {number: f'{{"alert": "a{number}"}}' for number in (1, 2, 11)}
    drawings = {1: '{"name": "gate"}'}
    async with opened(lambda: SqliteJournal.open(path)) as journal:
        for fleet in ("farm", "port"):
            await journal.write_alerts(fleet, alerts)
            await journal.write_drawings(fleet, drawings)
    assert salvage(path, tmp_path / "whole.db", "anna").whole
    change(path, "UPDATE alerts SET alert = CAST('{' AS BLOB) WHERE fleet = 'port' AND number = 2")
    target = tmp_path / "new.db"
    assert salvage(path, target, "anna").problems == ["1 rows of the table `alerts` cannot be read"]
    async with opened(lambda: SqliteJournal.open(target)) as journal:
        assert await journal.alerts("farm") == alerts
        assert list(await journal.alerts("port")) == [1, 11]
        assert await journal.drawings("farm") == await journal.drawings("port") == drawings


async def test_a_run_that_is_gone_whole_is_not_forgotten(path: Path, tmp_path: Path) -> None:
    for table in ("runs", "standings", "entries"):
        change(path, f"DELETE FROM {table} WHERE run = 3")
    target = tmp_path / "new.db"
    (wrong,) = [run for run in salvage(path, target, "anna").runs if run.problem]
    assert wrong.problem == f"the run is missing: {ENTRIES} records of it were acknowledged"
    async with opened(lambda: SqliteJournal.open(target)) as journal:
        assert (await info(journal, "r3")).gone


async def test_a_deleted_run_is_no_loss_and_its_number_not_given_again(
    path: Path, tmp_path: Path
) -> None:
    async with opened(lambda: SqliteJournal.open(path)) as journal:
        await journal.delete(["r2", "r3"], by="anna", unended=True)
    target = tmp_path / "new.db"
    assert salvage(path, target, "anna").whole
    async with opened(lambda: SqliteJournal.open(target)) as journal:
        assert [each.run for each in await journal.deletions()] == ["r2", "r3"]
        assert await journal.create(HEADER) == "r4"


def harmed(path: Path, how: Callable[[bytearray], None]) -> None:
    harm = bytearray(path.read_bytes())
    how(harm)
    path.write_bytes(harm)


def flip(place: int) -> Callable[[bytearray], None]:
    def flipped(harm: bytearray) -> None:
        harm[place] ^= 0x10

    return flipped


@pytest.mark.parametrize("place", [3, 16, 18, 28, 44, 56, 105, 2000, 4000])
async def test_all_is_salvaged_when_the_first_page_of_the_file_is_damaged(
    path: Path, tmp_path: Path, place: int
) -> None:
    harmed(path, flip(place))
    before = content(path)
    found = salvage(path, tmp_path / "new.db", "anna")
    assert content(path) == before
    assert [(run.entries, run.problem) for run in found.runs] == [(ENTRIES, "")] * RUNS
    assert len(found.schedule) == 1


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
async def test_a_truncated_file_gives_what_is_left(
    path: Path, tmp_path: Path, share: float
) -> None:
    def cut(harm: bytearray) -> None:
        del harm[round(len(harm) * share) :]

    async with opened(lambda: SqliteJournal.open(path)) as journal:
        entries = {run: await written(journal, run) for run in ("r1", "r2", "r3")}
    harmed(path, cut)
    found = look(path)
    assert not found.whole
    target = tmp_path / "new.db"
    salvage(path, target, "anna")
    async with opened(lambda: SqliteJournal.open(target)) as journal:
        for line in await journal.runs():
            if not line.gone:
                kept = await written(journal, line.run)
                assert kept == entries[line.run][: len(kept)]


@pytest.mark.parametrize("suffix", ["", "-wal", "-mark"])
async def test_whatever_bit_is_flipped_only_what_was_written_is_salvaged(
    tmp_path: Path, suffix: str
) -> None:
    (tmp_path / "left").mkdir()
    left = tmp_path / "left" / "journal.db"
    acknowledged = kill_executive(left, 60)
    files = [left.with_name(f"{left.name}{what}") for what in ("", "-wal", "-lock", "-mark")]
    async with opened(lambda: SqliteJournal.open(copied(files, tmp_path / "whole"))) as journal:
        entries = {run: await written(journal, run) for run in acknowledged}
    size = min(files[0].with_name(left.name + suffix).stat().st_size, 400_000)
    for place in range(7, size, size // 12):
        path = copied(files, tmp_path / "copy")
        harmed(path.with_name(path.name + suffix), flip(place))
        shutil.rmtree(tmp_path / "new", ignore_errors=True)
        (tmp_path / "new").mkdir()
        target = tmp_path / "new" / "journal.db"
        salvage(path, target, "anna")
        async with opened(partial(SqliteJournal.open, target)) as journal:
            for line in await journal.runs():
                if not line.gone:
                    kept = await written(journal, line.run)
                    assert kept == entries[line.run][: len(kept)], (suffix, place)
                assert line.loss is not None


def test_what_is_no_journal_is_refused_and_nothing_left(tmp_path: Path) -> None:
    path = tmp_path / "journal.db"
    path.write_bytes(b"a text that is long enough to be read as a database" * 200)
    with pytest.raises(JournalError, match="it is not a journal of m2pem"):
        salvage(path, tmp_path / "new.db", "anna")
    assert list(tmp_path.glob("new.db*")) == []


async def test_no_file_is_replaced(path: Path) -> None:
    with pytest.raises(JournalError, match="exists already; name a new file"):
        salvage(path, path, "anna")
