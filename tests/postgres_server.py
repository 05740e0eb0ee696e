"""A PostgreSQL server of the tests' own, in a temporary folder: the fixtures `postgres`, and
`postgres_url`, an empty database of it.

It answers on a Unix socket alone, or also on a host of its own (`bench.network`), and its clock may
be set wrong. The server refuses to run as root: root runs it as `postgres`.
"""

import atexit
import os
import pwd
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from itertools import count
from pathlib import Path

import psycopg
import pytest

from tests.faults import Faults, library

ROLE = "m2pem"


def programs() -> Path:
    """Return the folder of the server's programs; fails where PostgreSQL is not installed."""
    found = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"), key=lambda each: each.parts[4])
    if found:
        return found[-1].parent
    initdb = shutil.which("initdb")
    if initdb is None:
        pytest.fail("PostgreSQL is not installed: make test installs it (Debian: postgresql)")
    return Path(initdb).parent


class PostgresServer:
    """A server that runs until `remove`. The role `m2pem` may log in, and owns each database.

    `primary`: whose standby it is, until it is promoted. `ahead_s`: how far its clock is ahead.
    `inside`: the words before a command that is to run on its host; `address`: of that host.
    """

    def __init__(
        self,
        programs: Path,
        primary: "PostgresServer | None" = None,
        *,
        ahead_s: int = 0,
        inside: Sequence[str] = (),
        address: str = "",
    ) -> None:
        self.programs = programs
        self._numbers = count(1)
        self._inside, self._address = inside, address
        self.folder = Path(tempfile.mkdtemp(prefix="m2pem-pg-"))
        if os.geteuid() == 0:
            user = pwd.getpwnam("postgres")
            os.chown(self.folder, user.pw_uid, user.pw_gid)
        self.folder.chmod(0o755)
        self._data = self.folder / "data"
        self._variables: dict[str, str] = {}
        if ahead_s:
            clock = Faults(self.folder)
            clock.set(f"clock {time.CLOCK_REALTIME} {ahead_s}")
            self._variables = {"LD_PRELOAD": str(library()), **clock.variables}
        if primary is not None:
            self._run("pg_basebackup", "-D", self._data, "-U", "postgres",
                      "-h", primary.host,
                      "--write-recovery-conf", "--checkpoint=fast", "--no-sync")  # fmt: skip
            self.start()
            return
        self._run("initdb", "-D", self._data, "-U", "postgres", "-A", "trust", "--no-sync",
                  "-E", "UTF8", "--locale=C")  # fmt: skip
        if address:
            with (self._data / "pg_hba.conf").open("a") as rules:
                rules.write("host all,replication all samenet trust\n")
        self.start()
        self.execute(f"CREATE ROLE {ROLE} LOGIN")

    @property
    def host(self) -> str:
        """Where it is, as libpq takes it."""
        return self._address or str(self.folder)

    def start(self) -> None:
        """Start it; returns when it answers."""
        options = (
            f"-k {self.folder} -c listen_addresses={self._address} -c fsync=off"
            " -c max_connections=200"
        )
        self._run("pg_ctl", "-D", self._data, "-o", options, "-l", self.folder / "log", "-w",
                  "start")  # fmt: skip

    def stop(self, mode: str = "immediate") -> None:
        """End it, as a crash does, or in another of pg_ctl's modes."""
        self._run("pg_ctl", "-D", self._data, "-m", mode, "-w", "stop")

    def promote(self) -> None:
        """Let a standby take over; returns when it can be written to."""
        self._run("pg_ctl", "-D", self._data, "-w", "promote")

    def kill(self) -> None:
        """Kill all of its processes (SIGKILL)."""
        file = self._data / "postmaster.pid"
        process = int(file.read_text().split()[0])
        children = Path(f"/proc/{process}/task/{process}/children").read_text().split()
        for each in (process, *map(int, children)):
            with suppress(ProcessLookupError):
                os.kill(each, signal.SIGKILL)
        file.unlink()

    def remove(self) -> None:
        """End it, and remove its files."""
        if (self._data / "postmaster.pid").exists():
            self.stop()
        shutil.rmtree(self.folder)

    def new_database(self) -> str:
        """Make an empty database; returns its URL."""
        name = f"journal{next(self._numbers)}"
        self.execute(f"CREATE DATABASE {name} OWNER {ROLE}")
        return self.url(name)

    def url(self, database: str, user: str = ROLE) -> str:
        """The URL of a database."""
        return f"postgresql://{user}@/{database}?host={self.folder}"

    def execute(self, statement: str, url: str | None = None) -> list[tuple[object, ...]]:
        """Carry out a statement as the superuser, or over a URL."""
        with psycopg.connect(url or self.url("postgres", "postgres"), autocommit=True) as made:
            found = made.execute(statement)  # type: ignore[call-overload]
            return found.fetchall() if found.description else []

    def _run(self, program: str, *arguments: object) -> None:
        words = [str(self.programs / program), *map(str, arguments)]
        user = pwd.getpwnam("postgres") if os.geteuid() == 0 else None
        if self._inside:  # for which root is needed: nsenter becomes the user
            assert user is not None
            ids = ("--setuid", str(user.pw_uid), "--setgid", str(user.pw_gid), "--")
            words = [*self._inside[:-1], *ids, *words]
            user = None
        with (self.folder / "output").open("ab") as output:
            code = subprocess.run(
                words,
                cwd=self.folder,
                stdout=output,
                stderr=output,
                check=False,
                user=user and user.pw_uid,
                group=user and user.pw_gid,
                extra_groups=user and os.getgrouplist("postgres", user.pw_gid),
                env={**os.environ, **self._variables},
            ).returncode
        assert code == 0, (self.folder / "output").read_text()


def start_server() -> PostgresServer:
    """Start a server; fails where PostgreSQL is not installed."""
    return PostgresServer(programs())


@cache
def shared_server() -> PostgresServer:
    """The server of this process, which ends with it: to start one takes two seconds."""
    server = start_server()
    atexit.register(server.remove)
    return server


@pytest.fixture(scope="session")
def postgres() -> PostgresServer:
    """A server; fails where PostgreSQL is not installed."""
    return shared_server()


@dataclass
class Replicated:
    """A server with a standby that has all that it commits. `url` names both."""

    primary: PostgresServer
    standby: PostgresServer
    url: str

    def fail_over(self) -> None:
        """Kill the server, and let the standby take over."""
        self.primary.kill()
        self.standby.promote()


def replicate(primary: PostgresServer, standby: PostgresServer) -> Replicated:
    """Let a server wait for its standby with each commit; makes a database without tables."""
    url = primary.new_database().replace(str(primary.folder), f"{primary.host},{standby.host}")
    primary.execute("ALTER SYSTEM SET synchronous_standby_names = '*'")
    primary.execute("ALTER SYSTEM SET synchronous_commit = 'remote_apply'")
    primary.execute("SELECT pg_reload_conf()")
    return Replicated(primary, standby, url)


@pytest.fixture
def replicated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Replicated]:
    """A database without tables, on two servers."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    primary = start_server()
    standby = PostgresServer(primary.programs, primary)
    yield replicate(primary, standby)
    standby.remove()
    primary.remove()


@pytest.fixture
def postgres_url(postgres: PostgresServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """The URL of an empty database; what is beside the journal is in a folder of the test."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return postgres.new_database()
