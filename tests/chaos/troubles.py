"""What is wrong while an operator stops all: the executive's process, its database, its vehicles.

A trouble of the process itself is installed in it (`install`), and is there as long as a file is.
"""

import asyncio
import functools
import os
import signal
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from m2pem.journal.postgres_address import read_address
from tests.chaos.kill_points import POSTGRES, SQLITE, Place, place_of
from tests.chaos.missions import ChaosMission, process
from tests.chaos.worlds import OF_ROS, BlockingHost, MavlinkVehicles, SimulatedVehicles
from tests.faults import Faults
from tests.postgres_server import shared_server

VEHICLE = "ugv1"
"""The one whose arbiter hangs, or whose link is cut."""


@dataclass(frozen=True, slots=True)
class Trouble:
    """`mute`: nothing can be recorded while it is there. `calls`: those of the arbiter for
    `VEHICLE` that do not return meanwhile; `done`: though it has done what it was asked. `deaf`:
    the vehicle that nothing reaches, "" for all; None: there is none."""

    name: str
    worlds: tuple[str, ...] = (SimulatedVehicles.name, MavlinkVehicles.name, *OF_ROS)
    journals: tuple[str, ...] = (SQLITE.name, POSTGRES.name)
    mute: bool = False
    calls: tuple[str, ...] = ()
    done: bool = False
    deaf: str | None = None
    mission: ChaosMission | None = None


ENDLESS = ChaosMission(
    "endless.bpmn",
    process(
        '<scriptTask id="Prepare"><script>n = 1</script></scriptTask>'
        '<exclusiveGateway id="Again"/><exclusiveGateway id="Leave" default="Leave_Again"/>'
        '<sequenceFlow id="Out" sourceRef="Leave" targetRef="E">'
        "<conditionExpression>n &lt; 0</conditionExpression></sequenceFlow>",
        "S Prepare Again Leave Again",
    ),
    (),
)
_ITEMS = "[" + ", ".join(map(str, range(300))) + "]"
_SLOW = "some {0} in l satisfies {1}"
_CONDITION = functools.reduce(lambda inner, name: _SLOW.format(name, inner), "dcba", "a &lt; 0")
SLOW = ChaosMission(
    "slow.bpmn",
    process(
        f'<scriptTask id="Prepare"><script>l = {_ITEMS}</script></scriptTask>'
        '<exclusiveGateway id="Ever" default="Ever_Past"/><task id="Past"/>'
        '<sequenceFlow id="Out" sourceRef="Ever" targetRef="E">'
        f"<conditionExpression>= {_CONDITION}</conditionExpression></sequenceFlow>",
        "S Prepare Ever Past E",
    ),
    (),
)

_WORLDS = (SimulatedVehicles.name, MavlinkVehicles.name, BlockingHost.name, *OF_ROS)
NONE = Trouble("nothing", worlds=_WORLDS)
TROUBLES = {
    each.name: each
    for each in (
        NONE,
        Trouble("the disk hangs", mute=True),
        Trouble("start never returns", calls=("start",)),
        Trouble("start never returns, and has begun", calls=("start",), done=True),
        Trouble("cancel never returns", calls=("cancel",), deaf=VEHICLE),
        Trouble("no call returns", calls=("start", "cancel", "hold", "resume"), deaf=VEHICLE),
        Trouble("paused"),
        Trouble("endless loop", mission=ENDLESS),
        Trouble("long expression", mission=SLOW),
        Trouble("database gone", journals=(POSTGRES.name,), mute=True),
        Trouble("database silent", journals=(POSTGRES.name,), mute=True),
        Trouble("link cut", worlds=(SimulatedVehicles.name,), deaf=VEHICLE),
        Trouble("arbiter blocks", worlds=(BlockingHost.name,), deaf=VEHICLE),
        Trouble("vehicles silent", worlds=(MavlinkVehicles.name, *OF_ROS), deaf=""),
    )
}


# --- from outside ---------------------------------------------------------------------------------


@contextmanager
def database_of(file: Path, *, silent: bool) -> Iterator[None]:
    """Have the server of a journal killed within the block, or `silent`: its processes stopped."""
    if not silent:
        server = shared_server()
        server.stop()
        try:
            yield
        finally:
            server.start()
        return
    name = read_address(file).url.rpartition("/")[2].partition("?")[0]
    asked = f"SELECT pid FROM pg_stat_activity WHERE datname = '{name}'"
    stopped = [int(str(pid)) for (pid,) in shared_server().execute(asked)]
    for pid in stopped:
        os.kill(pid, signal.SIGSTOP)
    try:
        yield
    finally:
        for pid in stopped:
            os.kill(pid, signal.SIGCONT)


@contextmanager
def disk_of(file: Path, faults: Faults) -> Iterator[None]:
    """Have no write to a journal, or a file beside it, come to its end within the block."""
    faults.hang("write", "sync", name=f"{file.parent.name}/{file.name}")
    try:
        yield
    finally:
        faults.clear()


# --- in the executive -----------------------------------------------------------------------------

Call = Callable[..., Awaitable[Any]]


def install(name: str, arbiter: str, while_there: Path) -> None:
    """Have a trouble in this process, as long as a file is there. `arbiter`: `module:name`."""
    trouble, of_behavior = TROUBLES[name], dict[str, str]()

    async def gone() -> None:
        while while_there.exists():  # noqa: ASYNC110, ASYNC240  # another process removes it
            await asyncio.sleep(0.01)

    def hanging(function: Call) -> Call:
        @functools.wraps(function)
        async def around(self: Any, subject: Any, *more: Any) -> None:
            if hasattr(subject, "resources"):
                of_behavior[subject.id] = subject.resources[0]
            named = getattr(subject, "id", subject)
            resource = of_behavior.get(named, named)
            concerned = function.__name__ in trouble.calls and resource == VEHICLE
            if concerned and not trouble.done:
                await gone()
            await function(self, subject, *more)
            if concerned and trouble.done:
                await gone()

        return around

    def connecting(function: Call) -> Call:
        async def cut(arbiter: Any) -> None:
            while not while_there.exists():  # noqa: ASYNC110, ASYNC240  # another one makes it
                await asyncio.sleep(0.01)
            arbiter.lose_link(VEHICLE)
            await gone()
            arbiter.restore_link(VEHICLE)

        @functools.wraps(function)
        async def around(self: Any) -> None:
            await function(self)
            self.cutting = asyncio.create_task(cut(self))

        return around

    for call in ("start", *trouble.calls) if trouble.calls else ():
        _wrap(place_of(f"{arbiter}.{call}"), hanging)
    if trouble.name == "link cut":
        _wrap(place_of(f"{arbiter}.connect"), connecting)


def _wrap(place: Place, wrapper: Callable[[Call], Call]) -> None:
    if not hasattr(place.function, "__wrapped__"):
        setattr(place.owner, place.name, wrapper(place.function))
