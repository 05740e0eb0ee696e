"""The journal in PostgreSQL: its contract, a server that ends meanwhile, what it says of errors."""

import asyncio
import socket
import threading
from functools import partial

import psycopg
import pytest

from m2pem.errors import JournalError
from m2pem.journal import file_of, open_journal
from m2pem.journal.postgres_database import MIGRATIONS
from m2pem.scheduling.entry import EntryState
from m2pem.testing.contracts.journal import JournalContract
from m2pem.testing.contracts.journal_harness import HEADER, PLAN, entry, info, opened, written


@pytest.mark.tried_with(
    "PostgreSQL",
    "the contract of journals",
    kind="Databases and brokers",
    result="kept",
    version="15",
)
class TestPostgresJournal(JournalContract):
    @pytest.fixture
    def open_journal(self, postgres_url):
        return lambda: open_journal(postgres_url)


async def test_calls_that_wait_together_share_a_commit(postgres_url):
    async with opened(lambda: open_journal(postgres_url)) as journal:
        runs = [await journal.create(HEADER) for _ in range(100)]
        before = journal.commits
        for seq in range(1, 6):
            await asyncio.gather(*(journal.append([entry(run, seq)]) for run in runs))
        assert 5 <= journal.commits - before <= 25
        assert {found.last_seq for found in await journal.runs()} == {5}


async def test_executives_that_create_runs_at_the_same_time_give_each_its_own_number(postgres_url):
    async with opened(lambda: open_journal(postgres_url)) as one:
        async with opened(lambda: open_journal(postgres_url)) as two:
            made = await asyncio.gather(
                *(journal.create(HEADER) for _ in range(10) for journal in (one, two))
            )
        assert sorted(made, key=lambda run: int(run[1:])) == [f"r{n}" for n in range(1, 21)]


async def test_an_executive_is_told_of_what_others_change_also_after_it_could_not_be(
    postgres, postgres_url
):
    opening = partial(open_journal, postgres_url)
    async with opened(opening) as one, opened(opening) as two:
        seen = await asyncio.wait_for(one.changed(0), 30)
        postgres.execute(
            "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE query LIKE 'LISTEN%'"
        )
        again = await asyncio.wait_for(one.changed(seen), 30)
        assert again == seen + 1
        await one.schedule(PLAN, EntryState(5))
        await two.schedule(PLAN, EntryState(5))
        assert await asyncio.wait_for(one.changed(again), 30) == again + 1  # not of its own


# --- a server that ends -----------------------------------------------------------------------


@pytest.mark.parametrize("mode", ["fast", "immediate"])
async def test_a_server_that_starts_again_within_the_lease_interrupts_nothing(
    postgres, postgres_url, monkeypatch, mode
):
    monkeypatch.setenv("M2PEM_LEASE_S", "120")
    async with opened(lambda: open_journal(postgres_url)) as journal:
        runs = [await journal.create(HEADER) for _ in range(3)]
        await journal.append([entry(run, 1) for run in runs])
        assert len(await written(journal, runs[0])) == 1
        postgres.stop(mode)
        calls = [asyncio.ensure_future(journal.append([entry(run, 2)])) for run in runs]
        reading = asyncio.ensure_future(journal.runs())
        await asyncio.to_thread(postgres.start)
        await asyncio.gather(*calls)
        assert [each.last_seq for each in await reading] in ([1, 1, 1], [2, 2, 2])
        assert len(await written(journal, runs[0])) == 2


async def test_a_server_that_is_gone_is_told_of_and_its_return_is_noticed(
    postgres, postgres_url, monkeypatch
):
    monkeypatch.setenv("M2PEM_LEASE_S", "1.5")
    async with opened(lambda: open_journal(postgres_url)) as journal:
        run = await journal.create(HEADER)
        postgres.stop()
        try:
            for asked in (journal.append([entry(run, 1)]), journal.runs(), journal.check()):
                with pytest.raises(JournalError, match="no PostgreSQL server answers there"):
                    await asked
            await journal.release(run)
        finally:
            await asyncio.to_thread(postgres.start)
        await journal.check()
        assert await written(journal, run) == []


class Wire(threading.Thread):
    """Passes on what a journal and its server say, until the journal says COMMIT of an append.

    `delivered`: whether the server still gets it. Its answer never arrives.
    """

    def __init__(self, folder, server, delivered):
        super().__init__(daemon=True)
        self.cut = threading.Event()
        self.armed = threading.Event()
        self._server = server
        self._delivered = delivered
        self._listening = socket.socket(socket.AF_UNIX)
        self._listening.bind(str(folder / ".s.PGSQL.5432"))
        self._listening.listen()

    def run(self):
        while True:
            here, _ = self._listening.accept()
            there = socket.socket(socket.AF_UNIX)
            there.connect(str(self._server / ".s.PGSQL.5432"))
            asked = threading.Event()
            for way in (self._ask, self._answer):
                threading.Thread(target=way, args=(here, there, asked), daemon=True).start()

    def _ask(self, here, there, asked):
        while said := self._received(here):
            if self.armed.is_set() and b"COMMIT" in said and not self.cut.is_set():
                self.cut.set()
                if not self._delivered:
                    break
                asked.set()
            there.sendall(said)
        self._end(here, there)

    def _answer(self, here, there, asked):
        while (said := self._received(there)) and not asked.is_set():
            try:
                here.sendall(said)
            except OSError:
                break
        self._end(here, there)

    @staticmethod
    def _end(here, there):
        for each in (here, there):
            try:
                each.shutdown(socket.SHUT_RDWR)
            except OSError:
                continue

    @staticmethod
    def _received(one):
        try:
            return one.recv(65536)
        except OSError:
            return b""


@pytest.mark.parametrize("delivered", [False, True])
async def test_a_commit_whose_answer_is_lost_is_written_once(
    postgres, postgres_url, tmp_path, delivered
):
    wire = Wire(tmp_path, postgres.folder, delivered)
    wire.start()
    url = postgres_url.replace(str(postgres.folder), str(tmp_path))
    async with opened(lambda: open_journal(url)) as journal:
        run = await journal.create(HEADER)
        wire.armed.set()
        await journal.append([entry(run, 1), entry(run, 2)])
        assert wire.cut.is_set()
        await journal.append([entry(run, 3)])
        assert [each.seq for each in await written(journal, run)] == [1, 2, 3]


async def test_a_commit_that_was_not_made_is_made_though_its_number_was_given_to_another(
    postgres, postgres_url, tmp_path
):
    """As by a server that has crashed, or has taken over: the number says that it was."""
    name = postgres_url.partition("@/")[2].partition("?")[0]
    postgres.execute(f"ALTER DATABASE {name} SET search_path = public, pg_catalog")
    postgres.execute(
        "CREATE FUNCTION public.pg_xact_status(xid8) RETURNS text LANGUAGE sql"
        " AS $$ SELECT 'committed' $$",
        postgres.url(name, "postgres"),
    )
    await test_a_commit_whose_answer_is_lost_is_written_once(
        postgres, postgres_url, tmp_path, delivered=False
    )


# --- losses -----------------------------------------------------------------------------------


async def test_a_database_that_was_restored_from_an_older_backup_is_noticed(
    postgres, postgres_url, caplog
):
    async with opened(lambda: open_journal(postgres_url)) as journal:
        run = await journal.create(HEADER)
        await journal.append([entry(run, 1)])
        older = postgres.execute("SELECT * FROM standings", postgres_url)[0]
        await journal.append([entry(run, 2)])
    postgres.execute("DELETE FROM entries WHERE seq = 2", postgres_url)
    with psycopg.connect(postgres_url) as connection:
        connection.execute("DELETE FROM standings")
        connection.execute(f"INSERT INTO standings VALUES ({', '.join(['%s'] * 11)})", older)
    async with opened(lambda: open_journal(postgres_url)) as journal:
        assert "acknowledged record 2, and its last one now is 1" in caplog.text
        loss = (await info(journal, run)).loss
        assert (loss.acknowledged, loss.found) == (2, 1)
        with pytest.raises(JournalError, match="no run begins"):
            await journal.create(HEADER)


async def test_another_database_at_the_same_address_is_noticed(postgres, postgres_url):
    await open_journal(postgres_url).close()
    for (table,) in postgres.execute("SELECT tablename FROM pg_tables WHERE schemaname = 'public'",
                                     postgres_url):  # fmt: skip
        postgres.execute(f"DROP TABLE {table} CASCADE", postgres_url)
    with pytest.raises(JournalError, match="is the mark of another journal"):
        open_journal(postgres_url)


async def test_a_changed_entry_is_named(postgres, postgres_url):
    async with opened(lambda: open_journal(postgres_url)) as journal:
        run = await journal.create(HEADER)
        await journal.append([entry(run, 1), entry(run, 2)])
        postgres.execute("UPDATE entries SET t_us = 7 WHERE seq = 2", postgres_url)
        with pytest.raises(JournalError, match="r1, record 2: it does not follow") as raised:
            await written(journal, run)
        assert "postgresql://m2pem@/journal" in str(raised.value)


async def test_a_text_that_postgresql_cannot_have_is_written_all_the_same(postgres_url):
    from m2pem.engine.records import RunEnded, RunOutcome

    async with opened(lambda: open_journal(postgres_url)) as journal:
        run = await journal.create(HEADER)
        await journal.append([entry(run, 1, RunEnded(RunOutcome.FAILED, "a\0b"))])
        assert (await info(journal, run)).detail == "a\ufffdb"
        assert (await written(journal, run))[0].records[0].detail == "a\0b"


# --- what is no journal -----------------------------------------------------------------------


def refused(url):
    with pytest.raises(JournalError) as raised:
        open_journal(url)
    assert "s3cret" not in str(raised.value)
    return str(raised.value)


def test_what_is_wrong_with_a_server_is_said_with_its_remedy(postgres, postgres_url, tmp_path):
    database = postgres_url.partition("@/")[2].partition("?")[0]
    for url, expected in {
        f"postgresql://m2pem:s3cret@/nowhere?host={postgres.folder}": "createdb",
        f"postgresql://nobody:s3cret@/{database}?host={postgres.folder}": "correct the user",
        f"postgresql://m2pem:s3cret@/{database}?host={tmp_path}": "no PostgreSQL server answers",
        "postgresql://m2pem:s3cret@127.0.0.1:1/x": "no PostgreSQL server answers",
        f"postgresql://m2pem@/{database}?host={postgres.folder}&nonsense=1": "nonsense",
        "postgresql://m2pem:s3cret@host/a/b": "write postgresql://user@host/database",
        "postgresql:///?service=nowhere": "pg_service.conf",
    }.items():
        assert expected in refused(url)


def test_a_database_of_another_program_is_left_alone(postgres, postgres_url):
    postgres.execute("CREATE TABLE customers (name TEXT)", postgres_url)
    assert "a database of another program" in refused(postgres_url)


async def test_a_journal_of_a_newer_release_is_left_alone(postgres, postgres_url):
    await open_journal(postgres_url).close()
    postgres.execute(f"UPDATE m2pem_format SET version = {len(MIGRATIONS) + 1}", postgres_url)
    assert "written by a newer m2pem" in refused(postgres_url)


def test_a_database_with_another_encoding_is_refused(postgres, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    postgres.execute("CREATE DATABASE latin ENCODING 'LATIN1' TEMPLATE template0 OWNER m2pem")
    assert "ENCODING 'UTF8'" in refused(postgres.url("latin"))


async def test_a_role_with_the_least_rights_writes_and_others_are_refused(postgres, postgres_url):
    await open_journal(postgres_url).close()
    postgres.execute("CREATE ROLE driver LOGIN")
    theirs = postgres_url.replace("//m2pem@", "//driver@")
    assert "grant the role SELECT, INSERT, UPDATE and DELETE" in refused(theirs)
    postgres.execute(
        "GRANT SELECT, INSERT, UPDATE, DELETE ON ALL TABLES IN SCHEMA public TO driver",
        postgres_url,
    )
    async with opened(lambda: open_journal(theirs)) as journal:
        run = await journal.create(HEADER)
        await journal.append([entry(run, 1)])
        await journal.release(run)
        await journal.delete([run], by="ann", unended=True)


async def test_a_server_that_flushes_nothing_is_warned_of_and_one_that_replies_early_is_told_not_to(
    postgres, postgres_url, caplog
):
    name = postgres_url.partition("@/")[2].partition("?")[0]
    postgres.execute(f"ALTER DATABASE {name} SET synchronous_commit = off")
    async with opened(lambda: open_journal(postgres_url)) as journal:
        assert "fsync = off: entries that were acknowledged may be lost" in caplog.text
        await journal.create(HEADER)
        ((seen,),) = postgres.execute("SHOW synchronous_commit", postgres_url)
        assert seen == "off"  # of other connections


# --- its address ------------------------------------------------------------------------------


async def test_the_file_beside_which_others_are_names_the_journal_without_its_password(
    postgres_url,
):
    url = postgres_url.replace("m2pem@", "m2pem:s3cret@")
    file = file_of(url)
    async with opened(lambda: open_journal(url)) as journal:
        assert journal.file == file
        run = await journal.create(HEADER)
    assert file == file_of(postgres_url)
    assert "s3cret" not in file.read_text()
    assert file.stat().st_mode & 0o777 == 0o600
    async with opened(lambda: open_journal(str(file))) as again:
        assert again.file == file
        assert [each.run for each in await again.runs()] == [run]


def test_databases_have_files_of_their_own(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.delenv("PGHOST", raising=False)
    urls = ["postgresql://a@h/x", "postgresql://a@h/y", "postgresql://a@i/x",
            "postgresql://a@h:5433/x", "postgresql:///?service=x"]  # fmt: skip
    assert len({file_of(url) for url in urls}) == len(urls)
    same = ["postgresql://a@h/x", "postgres://b:pw@h:5432/x", "postgresql://c@/x?host=h"]
    assert len({file_of(url) for url in same}) == 1


def test_a_file_without_a_url_is_refused(tmp_path):
    file = tmp_path / "x.postgresql"
    with pytest.raises(JournalError, match="cannot be read"):
        open_journal(str(file))
    file.write_text("nothing")
    with pytest.raises(JournalError, match="does not have the URL"):
        open_journal(str(file))
