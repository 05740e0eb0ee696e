"""The table of faults x journals x arbiters: how missions end, what operators read, what is lost.

`python -m tests.chaos.fault_table` prints it as Markdown; docs/journal.md has it. `check` plays a
row, on the missions of the other rounds.
"""

import asyncio
import errno
import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

from m2pem.api import MissionControl
from m2pem.api.runs import Alert
from m2pem.control_socket.remote import RemoteControl
from m2pem.errors import M2pemError
from m2pem.journal.postgres_address import PostgresAddress, read_address, write_address
from tests.chaos import troubles
from tests.chaos.judge import judge
from tests.chaos.kill_points import POSTGRES, RANDOM, REPLACED, SQLITE
from tests.chaos.rounds import LOOK_EVERY_S, ROUND_WITHIN_S, Evidence, Kill, Plan, Play
from tests.chaos.worlds import HostedVehicles, MavlinkVehicles, RosVehicles, SimulatedVehicles
from tests.faults import Faults, with_faults
from tests.faults.tcp_proxy import TcpProxy
from tests.postgres_server import shared_server

SIMULATED, MAVLINK, ZENOH = SimulatedVehicles.name, MavlinkVehicles.name, HostedVehicles.name
ROS = RosVehicles.name
JOURNALS = {SQLITE.name: "SQLite", POSTGRES.name: "PostgreSQL"}
ARBITERS = {SIMULATED: "simulated", MAVLINK: "MAVLink", ZENOH: "on a host (Zenoh)", ROS: "ROS 2"}
SPEEDS = {SIMULATED: 4.0, MAVLINK: 8.0, ZENOH: 1.0, ROS: 3.0}
"""So vehicles move for some seconds."""


class Fault(StrEnum):
    """What goes wrong."""

    KILLED = "executive killed (`kill -9`)"
    STOPPED = "executive stopped beyond its lease, with a standby"
    FULL = "disk full"
    IO_ERROR = "I/O error of the disk"
    READ_ONLY = "file system read-only"
    DATABASE_KILLED = "database server killed"
    CUT_OFF = "database cut off"
    LINK = "link to the vehicle lost, and back"
    HOST = "host of the arbiter killed"


DISK = {
    Fault.FULL: (errno.ENOSPC, "write"),
    Fault.IO_ERROR: (errno.EIO, "write"),
    Fault.READ_ONLY: (errno.EROFS, "write", "open"),
}
STORAGE = (*DISK, Fault.DATABASE_KILLED, Fault.CUT_OFF)
"""After these an executive has held its vehicles, and the next one takes its runs up."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What comes of a fault. `mission`, `operator`: as the page says it. `reads`: what operators
    read of it, one text of each; `later`: and when it is over. `failed`: whether the mission of
    the vehicle fails, which is then commanded to stop."""

    mission: str
    operator: str
    reads: tuple[tuple[str, ...], ...] = ()
    later: tuple[tuple[str, ...], ...] = ()
    failed: bool = False


@dataclass(frozen=True, slots=True)
class Row:
    """`outcome`: text says why there is no such case."""

    fault: Fault
    journal: str
    arbiter: str
    outcome: Outcome | str

    @property
    def id(self) -> str:
        """Of a test that plays it."""
        return f"{self.fault.name.lower()}-{self.journal}-{self.arbiter}"


_HELD = "`r1: held`, why (REASON), `Commanded to hold: uav1, ugv1`, `Mend the cause`"
_HELD_READS = (("r1: held: ",), ("r2: held: ",), ("Commanded to hold: ",), ("Mend the cause",))
_LATER = "is held; once that is mended, the next executive resumes and completes it"


def _held(*reasons: str) -> Outcome:
    """What comes of a fault of storage. `reasons`: operators read one of them."""
    said = " or ".join(f"`{each}`" for each in reasons)
    return Outcome(_LATER, _HELD.replace("REASON", said), (*_HELD_READS, reasons))


OUTCOMES = {
    Fault.KILLED: Outcome("completed by the next executive", "nothing"),
    Fault.STOPPED: Outcome(
        "completed by the standby; the former executive moves nothing",
        "`taking over` at the standby",
        (("taking over",),),
    ),
    Fault.FULL: _held("the disk is full; make room"),
    Fault.IO_ERROR: _held("the disk failed to read or write; look at it"),
    Fault.READ_ONLY: _held("the disk failed to read or write", "can only be read"),
    Fault.DATABASE_KILLED: _held(
        "no PostgreSQL server answers there", "the journal has not confirmed"
    ),
    Fault.CUT_OFF: _held("the journal has not confirmed"),
    Fault.LINK: Outcome(
        "fails, as nothing in it catches `LINK_LOST`; the vehicle is commanded to stop",
        "`ugv1: LINK_LOST`, then `its link is restored, it has ended what it did before`",
        (("ugv1: LINK_LOST: ",),),
        (("ugv1: its link is restored, it has ended what it did before",),),
        failed=True,
    ),
    Fault.HOST: Outcome(
        "completed: the host is started again and takes its behaviors up",
        "`no contact with host pi`",
        (("no contact with host pi",),),
    ),
}

ONE_HOST = "no such case: claims hold as long as the process has its files, stopped or not"
SERVER_DISK = "no such case: the disk is the server's, which ends or refuses commits"
NO_SERVER = "no such case: there is no server"
NO_HOST = "no such case: the arbiter is in the executive"


def _none(fault: Fault, journal: str, arbiter: str) -> str:
    """Why there is no such case; "" if there is."""
    if journal == SQLITE.name and fault is Fault.STOPPED:
        return ONE_HOST
    if journal == SQLITE.name and fault in (Fault.DATABASE_KILLED, Fault.CUT_OFF):
        return NO_SERVER
    if journal == POSTGRES.name and fault in DISK:
        return SERVER_DISK
    return NO_HOST if fault is Fault.HOST and arbiter != ZENOH else ""


ROWS = tuple(
    Row(fault, journal, arbiter, _none(fault, journal, arbiter) or OUTCOMES[fault])
    for fault in Fault
    for journal in JOURNALS
    for arbiter in ARBITERS
)
PLAYED = [row for row in ROWS if isinstance(row.outcome, Outcome)]


class FaultPlay(Play):
    """One row while it is played."""

    def __init__(self, row: Row, folder: Path) -> None:
        self._faults = Faults(folder)
        kills = {
            Fault.KILLED: (Kill(RANDOM, after_s=1.5),),
            Fault.STOPPED: (Kill(REPLACED, after_s=0.05),),
        }
        self._row = row
        speed = SPEEDS[row.arbiter]
        super().__init__(
            Plan(1, row.arbiter, row.journal, kills.get(row.fault, ()), speed=speed),
            folder,
            self._faults.variables,
            with_faults(),
        )
        self._flag = folder / "fault"
        self._alerts: list[Alert] = []
        if row.fault is Fault.LINK:  # before a vehicle counts as one that does not move
            fleet = self._world.fleet.read_text(encoding="utf-8")
            fleet = fleet.replace("120 s", "20 s")
            self._world.fleet.write_text(fleet, encoding="utf-8")
        self._database: TcpProxy | None = None
        if row.fault is Fault.CUT_OFF:
            direct = read_address(self._file).url
            self._database = TcpProxy(shared_server().folder / ".s.PGSQL.5432")
            name = direct.partition("?")[0].rpartition("/")[2]
            url = f"postgresql://m2pem@127.0.0.1:{self._database.port}/{name}"
            write_address(PostgresAddress(url, url, self._file))

    def close(self) -> None:
        """See `Play.close`."""
        super().close()
        if self._database is not None:
            self._database.close()

    def said(self) -> str:
        """Return all that operators have read."""
        lives = range(1, self._lives + 1)
        errors = [self._errors(life).read_text() for life in lives]
        return "\n".join([*errors, *(each.text for each in self._alerts)])

    def evidence(self) -> Evidence:
        """See `Play.evidence`."""
        return replace(super().evidence(), stopped=self._outcome.failed)

    @property
    def _outcome(self) -> Outcome:
        assert isinstance(self._row.outcome, Outcome)
        return self._row.outcome

    async def whole(self) -> None:
        """See `Play.whole`."""
        if self.plan.kills:
            await super().whole()
            assert self.reached, "no executive was killed"
            return
        link = f"troubles.install('link cut', {self._world.arbiter!r}, Path({str(self._flag)!r}))"
        cut = self._row.fault is Fault.LINK and self._row.arbiter == SIMULATED
        process = self._start(f"from tests.chaos import troubles\n{link}" if cut else "", "")
        async with asyncio.timeout(ROUND_WITHIN_S):
            path = await self._control(process)
        async with RemoteControl(path) as control:
            await self._connected(control)
            listening = asyncio.create_task(self._listen(control))
            operator = asyncio.create_task(self._operate(process))
            try:
                await self._until(self._move, operator)
                with self._fault():
                    await self._until(self._read)
                await self._until(self._read_later)
                if self._row.fault not in STORAGE:
                    async with asyncio.timeout(ROUND_WITHIN_S):
                        await operator
            finally:
                for task in (operator, listening):
                    task.cancel()
                await asyncio.gather(operator, listening, return_exceptions=True)
        process.terminate()
        await self._until(lambda: process.poll() is not None)
        if self._row.fault in STORAGE:
            await self.to_the_end()

    async def _listen(self, control: MissionControl) -> None:
        with suppress(M2pemError, OSError):
            async for event in control.subscribe():
                if isinstance(event, Alert):
                    self._alerts.append(event)

    async def _until(
        self, true: Callable[[], bool], operator: "asyncio.Task[None] | None" = None
    ) -> None:
        try:
            async with asyncio.timeout(ROUND_WITHIN_S):
                while not true():
                    await asyncio.sleep(LOOK_EVERY_S)
                    if operator is not None and operator.done():
                        await operator
                        raise AssertionError(f"all had ended before the fault: {self.said()}")
        except TimeoutError as error:
            raise AssertionError(f"{true.__name__}: never; {self.said()}") from error

    def _move(self) -> bool:
        """Whether a vehicle of each mission does something."""
        moving = {each.vehicle for each in self._world.begun()}
        return all(self._runs.values()) and {"ugv1", "ugv2"} <= moving

    def _read(self) -> bool:
        """Whether operators have read what they must."""
        return not self.unread(self._outcome.reads)

    def _read_later(self) -> bool:
        return not self.unread(self._outcome.later)

    def unread(self, texts: Sequence[tuple[str, ...]]) -> list[tuple[str, ...]]:
        """Return those of which operators have read no text."""
        said = self.said()
        return [some for some in texts if not any(each in said for each in some)]

    def stops(self, vehicle: str) -> bool:
        """Whether a vehicle was commanded to stop."""
        return any(
            each.vehicle == vehicle and each.begun is None and not each.arrived
            for each in self._world.signs()
        )

    @contextmanager
    def _fault(self) -> Iterator[None]:
        """Have the fault within the block."""
        fault = self._row.fault
        if fault in DISK:
            name = f"{self._file.parent.name}/{self._file.name}"
            self._faults.fail(*DISK[fault], name=name)
            try:
                yield
            finally:
                self._faults.clear()
        elif fault is Fault.DATABASE_KILLED:
            with troubles.database_of(self._file, silent=False):
                yield
        elif fault is Fault.HOST:
            self._world.send_signal(signal.SIGKILL)
            yield
        elif self._database is not None:
            with _partitioned(self._database):
                yield
        elif isinstance(self._world, HostedVehicles):
            with _partitioned(self._world.proxy):
                yield
        elif isinstance(self._world, MavlinkVehicles | RosVehicles):
            self._world.send_signal(signal.SIGSTOP)
            try:
                yield
            finally:
                self._world.send_signal(signal.SIGCONT)
        else:
            self._flag.touch()
            try:
                yield
            finally:
                self._flag.unlink()


@contextmanager
def _partitioned(proxy: TcpProxy) -> Iterator[None]:
    proxy.partitioned = True
    try:
        yield
    finally:
        proxy.partitioned = False


def check(row: Row, folder: Path) -> None:
    """Play a row.

    Raises:
        AssertionError: it came to something else than the row says.
    """
    outcome = row.outcome
    assert isinstance(outcome, Outcome)
    played = FaultPlay(row, folder)
    try:
        asyncio.run(played.whole())
        verdict = asyncio.run(judge(played.evidence(), None))
    finally:
        played.close()
    assert not verdict.faults, verdict.faults
    unread = played.unread((*outcome.reads, *outcome.later))
    assert not unread, f"no operator read {unread}: {played.said()}"
    ends = {name: end for name, (end, _) in verdict.ends.items()}
    if outcome.failed:
        # The other mission may need the same vehicle.
        assert ends.pop("in_turn.bpmn") in ("completed", "failed")
        assert ends == {"two_ways.bpmn": "failed"}
        assert played.stops(troubles.VEHICLE)
    else:
        assert ends == {"two_ways.bpmn": "completed", "in_turn.bpmn": "completed"}


def as_markdown(rows: Sequence[Row] = ROWS) -> str:
    """Return the table; rows of a fault that come to the same are one of its lines."""
    found: dict[tuple[Fault, Outcome | str], dict[str, list[str]]] = {}
    for row in rows:
        of = found.setdefault((row.fault, row.outcome), {})
        of.setdefault(JOURNALS[row.journal], []).append(ARBITERS[row.arbiter])
    lines = ["| fault | journal | vehicles | the mission | operators read | lost |"]
    lines.append("|---|---|---|---|---|---|")
    for (fault, outcome), of in found.items():
        by_vehicles: dict[str, list[str]] = {}
        for journal, some in of.items():
            by_vehicles.setdefault(", ".join(some), []).append(journal)
        for arbiters, journals in by_vehicles.items():
            cells = (
                (outcome.mission, outcome.operator, "nothing")
                if isinstance(outcome, Outcome)
                else (outcome, "", "")
            )
            every = arbiters if arbiters != ", ".join(ARBITERS.values()) else "all"
            lines.append(f"| {' | '.join((fault, ', '.join(journals), every, *cells))} |")
    return "\n".join(lines)


if __name__ == "__main__":
    print(as_markdown())
