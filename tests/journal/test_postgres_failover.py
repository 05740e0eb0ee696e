"""A server that is killed while runs are written, and its standby that takes over."""

import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

from m2pem.errors import JournalError
from m2pem.journal import open_journal
from m2pem.testing.contracts.journal_harness import info, opened, written
from tests.postgres_server import replicated

__all__ = ["replicated"]

pytestmark = pytest.mark.long

RUNS = 20


@pytest.fixture
def servers(replicated, monkeypatch):
    monkeypatch.setenv("M2PEM_LEASE_S", "30")
    return replicated


@contextmanager
def driving(url):
    """An executive that drives runs; it prints what was acknowledged."""
    program = str(Path(__file__).with_name("driving.py"))
    command = [sys.executable, program, url, str(RUNS)]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as child:
        try:
            yield child
        finally:
            child.kill()


def read(child, acknowledged, number):
    """Read so many acknowledgments; fewer if the executive ends."""
    for _ in range(number):
        if not (line := child.stdout.readline()):
            return
        run, seq = line.split()
        acknowledged.setdefault(run, []).append(int(seq))


def in_database(servers):
    """The first records of all entries, as the standby that has taken over says."""
    found = {}
    for run, seq in servers.standby.execute("SELECT run, seq FROM entries ORDER BY seq",
                                            servers.url):  # fmt: skip
        found.setdefault(f"r{run}", []).append(seq)
    return found


@pytest.mark.tried_with(
    "PostgreSQL",
    "a synchronous standby takes over",
    kind="Databases and brokers",
    result="nothing acknowledged is lost",
    version="15",
)
async def test_nothing_that_was_acknowledged_is_lost_when_a_synchronous_standby_takes_over(servers):
    acknowledged = {}
    with driving(servers.url) as child:
        read(child, acknowledged, 60 * RUNS)
        servers.fail_over()
        read(child, acknowledged, 60 * RUNS)  # it goes on, within its lease
        child.kill()
        read(child, acknowledged, sys.maxsize)
        assert "Error" not in child.stderr.read()
    assert len(acknowledged) == RUNS
    found = in_database(servers)
    assert {run: found[run][: len(seqs)] for run, seqs in acknowledged.items()} == acknowledged
    async with opened(lambda: open_journal(servers.url)) as journal:
        for run, seqs in found.items():
            assert [
                each.seq for each in await written(journal, run)
            ] == seqs  # the hashes are right
            assert (await info(journal, run)).loss is None


async def test_what_a_standby_without_synchronous_replication_has_lost_is_noticed(servers):
    primary, standby = servers.primary, servers.standby
    primary.execute("ALTER SYSTEM RESET synchronous_standby_names")
    primary.execute("SELECT pg_reload_conf()")
    acknowledged = {}
    with driving(servers.url) as child:
        read(child, acknowledged, 20 * RUNS)
        standby.stop("fast")
        read(child, acknowledged, 20 * RUNS)
        primary.kill()
        standby.start()
        standby.promote()
        read(child, acknowledged, sys.maxsize)  # the executive ends
        assert "the journal has lost records: it acknowledged record" in child.stderr.read()
    found = in_database(servers)
    lost = {run for run, seqs in acknowledged.items() if seqs[-1] not in found.get(run, ())}
    assert lost
    async with opened(lambda: open_journal(servers.url)) as journal:
        assert {each.run for each in await journal.runs() if each.loss is not None} == lost
        for run in lost & found.keys():
            loss = (await info(journal, run)).loss
            assert (loss.acknowledged >= acknowledged[run][-1]) and loss.found < loss.acknowledged
            assert [each.seq for each in await written(journal, run)] == found[run]


def test_a_standby_is_no_journal(servers):
    with pytest.raises(JournalError, match="the server is a standby"):
        open_journal(servers.url.replace(f"{servers.primary.folder},", ""))
