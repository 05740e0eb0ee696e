"""Who has a run of a journal in PostgreSQL, while executives live, stand still and die."""

import asyncio
import os
import signal
import socket
import subprocess
import sys
import time
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from m2pem.boot_time import boot_time_s
from m2pem.errors import FleetServedError, JournalError, StaleEpochError
from m2pem.journal import open_journal
from m2pem.testing.contracts.journal_harness import HEADER, entry, info, opened, written

LEASE_S = "1"


@pytest.fixture
def url(postgres_url, monkeypatch):
    monkeypatch.setenv("M2PEM_LEASE_S", LEASE_S)
    return postgres_url


@contextmanager
def driving(url, runs=1):
    """Another executive that drives new runs; r1 has an entry. It is killed in the end."""
    program = str(Path(__file__).with_name("driving.py"))
    command = [sys.executable, program, url, str(runs)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as child:
        try:
            while not child.stdout.readline().startswith("r1 "):
                assert child.poll() is None
            yield child
        finally:
            child.kill()


async def until_claimed(journal, run):
    """Claim a run as soon as its owner's lease has ended; returns the epoch, and what was said."""
    said = set()
    end_s = time.monotonic() + 60
    while True:
        try:
            return await journal.claim(run), said
        except JournalError as error:
            said.add(str(error))
            assert time.monotonic() < end_s
            await asyncio.sleep(0.02)


def end_leases(postgres, url):
    """As if the clock of the server, or a host that stood still, had gone past every lease."""
    postgres.execute("UPDATE executives SET lease_until = clock_timestamp()", url)


async def test_a_run_of_a_killed_executive_is_taken_when_its_lease_has_ended(url):
    with driving(url) as child:
        async with opened(lambda: open_journal(url)) as journal:
            assert (await info(journal, "r1")).driven
            with pytest.raises(JournalError, match="is driven by") as refused:
                await journal.claim("r1")
            for named in (f"process {child.pid} on {socket.gethostname()}", "driving.py"):
                assert named in str(refused.value)
            child.kill()
            epoch, said = await until_claimed(journal, "r1")
            assert epoch == 2
            assert [each for each in said if f"process {child.pid} on" not in each] == []
            last = (await info(journal, "r1")).last_seq
            await journal.append([entry("r1", last + 1, epoch=2)])
            assert (await written(journal, "r1"))[-1].epoch == 2


async def test_a_living_executive_keeps_its_runs_for_longer_than_a_lease(url):
    async with opened(lambda: open_journal(url)) as one, opened(lambda: open_journal(url)) as two:
        run = await one.create(HEADER)
        begun_s = one.owned_until_s
        while one.owned_until_s <= begun_s + 2 * one.lease_s:
            with pytest.raises(JournalError, match=f"driven by process {os.getpid()}"):
                await two.claim(run)
            await asyncio.sleep(0.05)
        await one.append([entry(run, 1)])


async def test_what_a_stopped_executive_writes_after_a_claim_is_refused(url):
    """A host that is suspended, or a process that stands still, does not know of it."""
    with driving(url) as child:
        async with opened(lambda: open_journal(url)) as journal:
            child.send_signal(signal.SIGSTOP)
            epoch, _ = await until_claimed(journal, "r1")
            before = await written(journal, "r1")
            child.send_signal(signal.SIGCONT)
            assert child.wait(timeout=60) != 0  # an append of it was refused
            assert await written(journal, "r1") == before
            await journal.append(
                [entry("r1", before[-1].seq + len(before[-1].records), epoch=epoch)]
            )


async def test_an_executive_whose_lease_has_ended_writes_nothing_more(postgres, url):
    """By the clock of the server, whatever that of the host says; also if no one has claimed it."""
    async with opened(lambda: open_journal(url)) as journal:
        run, other = await journal.create(HEADER), await journal.create(HEADER)
        await journal.append([entry(run, 1), entry(other, 1)])
        end_leases(postgres, url)
        raised = await asyncio.gather(
            journal.append([entry(run, 2)]), journal.append([entry(other, 2)]),
            return_exceptions=True,
        )  # fmt: skip
        assert [type(each) for each in raised] == [StaleEpochError] * 2
        assert "lease" in str(raised[0])
        assert len(await written(journal, run)) == 1
        with pytest.raises(JournalError, match="lease of this executive has ended"):
            await journal.create(HEADER)
        assert not (await info(journal, run)).driven


async def test_an_executive_that_let_go_of_what_it_lost_may_take_runs_again(postgres, url):
    async with opened(lambda: open_journal(url)) as journal:
        run = await journal.create(HEADER)
        end_leases(postgres, url)
        with pytest.raises(StaleEpochError):
            await journal.append([entry(run, 1)])
        await journal.release(run)
        epoch, said = await until_claimed(journal, run)
        assert epoch == 2
        assert all("lease" in each for each in said)
        await journal.append([entry(run, 1, epoch=2)])


async def test_a_claim_takes_one_run_and_leaves_the_others_of_its_owner_free(postgres, url):
    async with opened(lambda: open_journal(url)) as one, opened(lambda: open_journal(url)) as two:
        runs = [await one.create(HEADER) for _ in range(2)]
        end_leases(postgres, url)
        assert await two.claim(runs[0]) == 2
        assert (await info(two, runs[0])).driven
        assert not (await info(two, runs[1])).driven
        for run in runs:
            with pytest.raises(StaleEpochError):
                await one.append([entry(run, 1)])


async def test_the_end_of_a_lease_is_known_before_it_is_over(postgres, url):
    """By the executive's own clock, from the moment before the renewal was sent."""
    async with opened(lambda: open_journal(url)) as journal:
        assert journal.owned_until_s is None
        before_s = boot_time_s()
        run = await journal.create(HEADER)
        after_s = boot_time_s()
        assert before_s + journal.lease_s <= journal.owned_until_s <= after_s + journal.lease_s
        await journal.release(run)
        assert journal.owned_until_s is None


async def test_a_closed_journal_leaves_nothing_of_its_executive(postgres, url):
    async with opened(lambda: open_journal(url)) as journal:
        await journal.create(HEADER)
        assert len(postgres.execute("SELECT * FROM executives", url)) == 1
    assert postgres.execute("SELECT * FROM executives", url) == []
    assert postgres.execute("SELECT * FROM owners", url) == []


@pytest.mark.parametrize("text", ["", "5"])
async def test_the_lease_is_five_seconds_unless_the_environment_says_another(
    postgres_url, monkeypatch, text
):
    monkeypatch.setenv("M2PEM_LEASE_S", text)
    async with opened(lambda: open_journal(postgres_url)) as journal:
        assert journal.lease_s == 5


@pytest.mark.parametrize("text", ["0", "soon", "1e9", "nan"])
def test_a_lease_that_is_no_length_is_refused(postgres_url, monkeypatch, text):
    monkeypatch.setenv("M2PEM_LEASE_S", text)
    with pytest.raises(JournalError, match="M2PEM_LEASE_S="):
        open_journal(postgres_url)


async def test_a_fleet_is_free_when_the_lease_of_who_serves_it_has_ended(postgres, url):
    async with opened(lambda: open_journal(url)) as one, opened(lambda: open_journal(url)) as two:
        await one.serve_fleet("north", ["ugv1", "ugv2"])
        until_s = one.owned_until_s
        assert until_s is None  # it has no run
        with pytest.raises(FleetServedError, match=f"process {os.getpid()} on"):
            await two.serve_fleet("north", ["ugv1", "ugv2"])
        end_leases(postgres, url)
        await two.serve_fleet("north", ["ugv1", "ugv2"])
        with pytest.raises(FleetServedError):
            await one.serve_fleet("north", ["ugv1", "ugv2"])


async def test_a_lease_begins_with_a_fleet_and_is_renewed_without_a_run(postgres, url):
    async with opened(lambda: open_journal(url)) as one, opened(lambda: open_journal(url)) as two:
        await one.serve_fleet("north", ["ugv1", "ugv2"])
        end_s = boot_time_s() + 2 * one.lease_s
        while boot_time_s() < end_s:
            with pytest.raises(FleetServedError):
                await two.serve_fleet("north", ["ugv1", "ugv2"])
            await asyncio.sleep(0.05)
    assert postgres.execute("SELECT * FROM fleets", url) == []


async def test_who_has_lost_its_fleet_takes_no_run_before_it_serves_it_again(postgres, url):
    async with opened(lambda: open_journal(url)) as one, opened(lambda: open_journal(url)) as two:
        await one.serve_fleet("north", ["ugv1", "ugv2"])
        end_leases(postgres, url)
        await two.serve_fleet("north", ["ugv1", "ugv2"])
        with pytest.raises(JournalError, match="nothing is taken"):
            await one.create(HEADER)
        await two.leave_fleet("north")
        end_s = boot_time_s() + 60
        while True:  # its lease begins again
            try:
                await one.serve_fleet("north", ["ugv1", "ugv2"])
                break
            except JournalError as error:
                assert "lease of this executive has ended" in str(error)
                assert boot_time_s() < end_s
                await asyncio.sleep(0.02)
        assert await one.create(HEADER) == "r1"


async def test_an_older_executive_that_drives_on_keeps_the_length_of_its_lease(
    postgres, postgres_url, monkeypatch
):
    monkeypatch.setenv("M2PEM_LEASE_S", "60")
    async with opened(lambda: open_journal(postgres_url)) as older:
        await older.serve_fleet("north", ["ugv1"])
        for statement in (
            "ALTER TABLE executives DROP COLUMN lease, DROP COLUMN server_start",
            "DROP TABLE approvals, edits, alerts, drawings",
            "UPDATE m2pem_format SET version = version - 4",
        ):
            postgres.execute(statement, postgres_url)
        async with opened(lambda: open_journal(postgres_url)):
            kept = "SELECT lease >= interval '60 seconds' FROM executives"
            assert postgres.execute(kept, postgres_url) == [(True,)]


async def test_who_serves_its_fleet_again_ends_the_lease_that_was_its_own(postgres, url):
    async with opened(lambda: open_journal(url)) as one:
        await one.serve_fleet("north", ["ugv1"])
        end_leases(postgres, url)
        end_s = boot_time_s() + 60
        while postgres.execute(_SERVED, url) == []:
            with suppress(JournalError):  # its lease begins again
                await one.serve_fleet("north", ["ugv1"])
            assert boot_time_s() < end_s
            await asyncio.sleep(0.02)


_SERVED = (
    "SELECT resource FROM fleets JOIN executives ON id = executive"
    " WHERE lease_until > clock_timestamp()"
)
