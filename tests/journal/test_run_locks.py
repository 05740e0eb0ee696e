import multiprocessing
import os
import signal
import subprocess
import sys

import pytest

from m2pem.journal.run_locks import PosixRunLocks, RunLocks, run_locks

HOLD = """
import sys
from pathlib import Path
from m2pem.journal import run_locks
locks = getattr(run_locks, sys.argv[1])(Path(sys.argv[2]))
print(locks.acquire(7), flush=True)
sys.stdin.read()
"""


@pytest.fixture(params=[RunLocks, PosixRunLocks])
def kind(request):
    return request.param


@pytest.fixture
def open_locks(kind, tmp_path):
    opened = []

    def open_them():
        opened.append(kind(tmp_path / "journal.db-lock"))
        return opened[-1]

    yield open_them
    for locks in opened:
        locks.close()


@pytest.fixture
def holder(kind, tmp_path):
    """Another process, which holds the lock of run 7 until its input ends."""
    command = [sys.executable, "-c", HOLD, kind.__name__, str(tmp_path / "journal.db-lock")]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "True\n"
        yield child
        child.kill()


def test_a_lock_is_held_once(open_locks):
    locks = open_locks()
    assert not locks.held(7)
    assert locks.acquire(7)
    assert not locks.acquire(7)
    assert locks.held(7)
    assert locks.mine(7)
    assert not locks.held(6)
    assert not locks.held(8)
    locks.release(7)
    assert not locks.held(7)
    assert locks.acquire(7)


def test_two_journals_of_one_process_exclude_each_other(open_locks):
    one, two = open_locks(), open_locks()
    assert one.acquire(7)
    assert not two.acquire(7)
    assert two.held(7)
    assert not two.mine(7)
    two.release(7)
    assert one.held(7)
    assert two.acquire(8)
    assert one.held(8)


def test_closing_one_journal_frees_nothing_of_another(open_locks, holder, kind, tmp_path):
    one, two = kind(tmp_path / "other-lock"), kind(tmp_path / "other-lock")
    assert one.acquire(1)
    assert two.acquire(2)
    two.close()
    # Asked from another process: within this one the answer needs no lock.
    probe = "import sys; from pathlib import Path; from m2pem.journal import run_locks\n"
    probe += (
        f"locks = run_locks.{kind.__name__}(Path(sys.argv[1])); print(locks.held(1), locks.held(2))"
    )
    command = [sys.executable, "-c", probe, str(tmp_path / "other-lock")]
    assert subprocess.check_output(command, text=True) == "True False\n"
    one.close()


def test_another_process_is_excluded_until_it_is_killed(open_locks, holder):
    locks = open_locks()
    assert locks.held(7)
    assert not locks.acquire(7)
    assert not locks.mine(7)
    holder.send_signal(signal.SIGKILL)
    holder.wait()
    assert not locks.held(7)
    assert locks.acquire(7)


def test_a_process_that_ends_by_itself_frees_its_locks(open_locks, holder):
    locks = open_locks()
    holder.stdin.close()
    assert holder.wait() == 0
    assert locks.acquire(7)


def forked(locks, connection):
    connection.send(locks.mine(7))
    connection.recv()


def test_a_forked_child_does_not_keep_the_locks_of_its_parent(open_locks, tmp_path):
    locks = open_locks()
    locks.acquire(7)
    here, there = multiprocessing.Pipe()
    child = multiprocessing.get_context("fork").Process(target=forked, args=(locks, there))
    child.start()
    assert here.recv() is False
    locks.release(7)
    locks.close()
    assert open_locks().acquire(7)
    here.send("done")
    child.join()
    assert child.exitcode == 0


def test_closing_frees_all(open_locks):
    one, two = open_locks(), open_locks()
    assert one.acquire(1)
    assert one.acquire(2)
    one.close()
    assert two.acquire(1)
    assert two.acquire(2)


def test_the_lock_file_is_its_owners_alone_and_stays_empty(tmp_path):
    path = tmp_path / "journal.db-lock"
    locks = run_locks(path)
    locks.acquire(1)
    assert path.stat().st_mode & 0o777 == 0o600
    locks.close()
    assert path.read_bytes() == b""


@pytest.mark.skipif(sys.platform != "linux", reason="open file description locks are Linux's")
def test_linux_uses_open_file_description_locks(tmp_path):
    path = tmp_path / "journal.db-lock"
    locks = run_locks(path)
    assert locks.acquire(1)
    # A classic lock of this process would be lost here.
    os.close(os.open(path, os.O_RDWR))
    other = run_locks(path)
    assert other.held(1)
    locks.close()
    other.close()
