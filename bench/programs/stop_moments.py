"""STOP at random moments, under every fault at hand: how soon each vehicle has its cancel.

python -m bench.programs.stop_moments <moments> [<seed>]

For each moment one executive on the wall clock drives a mission in which every vehicle is on its
way, while something is wrong; an operator's STOP comes through the control socket after 0 to 0.5 s.
The vehicles note when their arbiter was asked to cancel. Those of an arbiter that itself hangs are
not reachable, and not counted.
"""

import asyncio
import json
import random
import socket
import sqlite3
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, closing, suppress
from pathlib import Path
from typing import Any

from bench.graphs import file
from bench.programs.stage import Plugins, flows
from m2pem.api.clock import SystemClock
from m2pem.control_socket.client import ask
from m2pem.control_socket.paths import address
from m2pem.control_socket.server import ControlSocket
from m2pem.errors import JournalError, M2pemError
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet import Domain, Fleet, Vehicle
from m2pem.journal.base import Entry
from m2pem.journal.sqlite import SqliteJournal
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.testing.fake_arbiter import FakeArbiter

VEHICLES = 4
PATIENCE_S = 8.0
WITHIN_S = 1.0
POINT: dict[str, Any] = {"type": "Point", "coordinates": [1, 1]}
"""Handing it over has every run commit something."""

SCENARIOS = (
    "well", "stalled", "full", "locked", "removed", "loop", "observer", "arbiter", "start",
    "paused", "flooded", "100 runs",
)  # fmt: skip


class Vehicles(FakeArbiter):
    """Notes when each cancel came (monotonic seconds). `hang`: what one vehicle's arbiter does."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.cancelled_s: dict[str, float] = {}
        self.hang = ""

    async def cancel(self, behavior: str, epoch: int) -> None:
        """See `Arbiter.cancel`."""
        if self._hangs("cancel", behavior):
            await asyncio.Event().wait()
        self.cancelled_s.setdefault(behavior, time.monotonic())
        await super().cancel(behavior, epoch)

    async def start(self, request: Any) -> None:
        """See `Arbiter.start`."""
        await super().start(request)
        if self._hangs("start", request.id):
            await asyncio.Event().wait()

    def _hangs(self, what: str, behavior: str) -> bool:
        return self.hang == what and behavior.endswith(".b1")


class FaultyJournal(SqliteJournal):
    """Fails, or waits, while told so."""

    full = False
    works: asyncio.Event | None = None

    async def append(self, entries: Sequence[Entry]) -> None:
        """See `Journal.append`."""
        if self.full:
            raise JournalError("the disk is full")
        if self.works is not None:
            await self.works.wait()
        await super().append(entries)


class Observing(Plugins):
    """One observer that never returns, if wanted."""

    hangs = False

    def records_committed(self, run_id: str, records: Any) -> None:
        """See `PluginManager.records_committed`."""
        if self.hangs:
            threading.Event().wait()


def mission(vehicles: Sequence[str], *, loops: bool) -> bytes:
    """Every vehicle drives; beside them a loop that never waits."""
    tasks = "".join(
        f'<scriptTask id="t{name}"><extensionElements>'
        '<m2pem:behavior type="vehicle" name="drive_stop"><m2pem:resources>'
        f'<m2pem:role name="driver" vehicle="{name}"/></m2pem:resources></m2pem:behavior>'
        "</extensionElements></scriptTask>"
        for name in vehicles
    )
    ways = [["start", "fork", f"t{name}"] for name in vehicles]
    unique = flows(["start", "fork"], *(way[1:] for way in ways))
    loop = ""
    if loops:
        loop = (
            '<exclusiveGateway id="join"/><task id="work"/><exclusiveGateway id="leave" '
            f'default="leave_join"/><endEvent id="end"/>{flows(["fork", "join", "work"])}'
            f'{flows(["work", "leave", "join"])}<sequenceFlow id="out" sourceRef="leave" '
            'targetRef="end"><conditionExpression>1 &gt; 2</conditionExpression></sequenceFlow>'
        )
    return file(
        f'<process id="P" isExecutable="true"><startEvent id="start"/>'
        f'<parallelGateway id="fork"/>{tasks}{unique}{loop}</process>'
    )


async def moment(scenario: str, chance: random.Random, folder: Path) -> list[float]:
    """Seconds from STOP to each reachable vehicle's cancel; `PATIENCE_S` where none came."""
    runs = 100 if scenario == "100 runs" else 1
    count = runs if runs > 1 else VEHICLES
    names = [f"v{number}" for number in range(count)]
    fleet = Fleet(
        "bench", "bench.yaml",
        {ResourceId(n): Vehicle(ResourceId(n), Domain.GROUND, "fake", {}) for n in names},
    )  # fmt: skip
    made: list[Vehicles] = []

    def make(*arguments: Any) -> Vehicles:
        made.append(Vehicles(*arguments))
        return made[0]

    path = folder / "journal.db"
    journal = FaultyJournal.open(path)
    assert isinstance(journal, FaultyJournal)
    plugins = Observing(make)
    plugins.hangs = scenario == "observer"
    running = Executive(fleet, journal, plugins, SystemClock(), watch_links=False)
    with ExitStack() as after:
        async with ControlSocket(running.control, path) as door, running:
            vehicles = made[0]
            vehicles.hang = {"arbiter": "cancel", "start": "start"}.get(scenario, "")
            groups = [[name] for name in names] if runs > 1 else [names]
            for group in groups:
                await running.control.start(mission(group, loops=scenario == "loop"))
            await vehicles.until_called("start", times=count)
            undo = await _spoil(scenario, running, journal, path, after)
            await asyncio.sleep(chance.uniform(0, 0.5))
            assert door.path is not None
            sent_s = await asyncio.to_thread(_stop, door.path, scenario)
            reachable = count - (scenario == "arbiter")
            end_s = sent_s + PATIENCE_S
            while len(vehicles.cancelled_s) < reachable and time.monotonic() < end_s:  # noqa: ASYNC110
                await asyncio.sleep(0.005)
            took = [at_s - sent_s for at_s in vehicles.cancelled_s.values()]
            took += [PATIENCE_S] * (reachable - len(took))
            undo()
            for behavior in list(vehicles.requests):
                vehicles.report(behavior, BehaviorState.CANCELLED)
    with suppress(M2pemError):
        await journal.close()
    return took


async def _spoil(
    scenario: str, running: Executive, journal: FaultyJournal, path: Path, after: ExitStack
) -> Callable[[], None]:
    """Have something go wrong; returns what ends it."""
    match scenario:
        case "stalled":
            works = journal.works = asyncio.Event()
            await running.control.set_geometry("p", POINT)
            return works.set
        case "full":
            journal.full = True
            await running.control.set_geometry("p", POINT)
        case "locked":
            other = after.enter_context(
                closing(sqlite3.connect(path, isolation_level=None, check_same_thread=False))
            )
            other.execute("BEGIN IMMEDIATE")
            await running.control.set_geometry("p", POINT)

            def unlock() -> None:
                other.execute("ROLLBACK")

            return unlock
        case "removed":
            await asyncio.to_thread(path.unlink)
        case "paused":
            await running.control.pause("r1")
        case "flooded":
            return _flood(path)
    return lambda: None


def _flood(path: Path) -> Callable[[], None]:
    """Callers that ask without end, and others that never finish a line."""
    ended = threading.Event()
    place = next((path.parent / f"{path.name}-control").glob("*.sock"))

    def call(line: bytes) -> None:
        with socket.socket(socket.AF_UNIX) as caller, suppress(OSError), address(place) as there:
            caller.settimeout(1)
            caller.connect(there)
            while not ended.is_set():
                caller.sendall(line)
                if line.endswith(b"\n"):
                    caller.recv(1 << 16)
                else:
                    ended.wait(0.1)

    lines = [b'{"jsonrpc":"2.0","method":"runs","id":1}\n'] * 10 + [b'{"jsonrpc"'] * 200
    for line in lines:
        threading.Thread(target=call, args=(line,), daemon=True).start()
    return ended.set


def _stop(place: Path, scenario: str) -> float:
    """As `m2pem stop` does; when it was sent."""
    sent_s = time.monotonic()

    def send() -> None:
        with suppress(M2pemError):
            if scenario == "100 runs":
                ask(place, "stop_all")
            else:
                ask(place, "stop", run="r1")

    threading.Thread(target=send, daemon=True).start()
    return sent_s


def main() -> None:
    """The command."""
    moments, *seed = map(int, sys.argv[1:])
    chance = random.Random(*seed)
    found: dict[str, list[float]] = {scenario: [] for scenario in SCENARIOS}
    for number in range(moments):
        scenario = SCENARIOS[number % len(SCENARIOS)]
        with tempfile.TemporaryDirectory(dir=Path.cwd()) as folder:
            found[scenario] += asyncio.run(moment(scenario, chance, Path(folder)))
    rows = {
        scenario: {
            "vehicles": len(took),
            "worst_ms": round(1000 * max(took), 1),
            "late": sum(each > WITHIN_S for each in took),
        }
        for scenario, took in found.items()
        if took
    }
    print(json.dumps({"moments": moments, "scenarios": rows}))


if __name__ == "__main__":
    main()
