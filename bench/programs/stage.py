"""An executive for the programs, and missions whose tokens wait."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from bench.graphs import file, path
from m2pem.api.clock import SystemClock
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet import Fleet
from m2pem.journal import Journal, MemoryJournal
from m2pem.journal.sqlite import SqliteJournal
from m2pem.plugins import PluginManager

NOTHING = Fleet("bench", "bench.yaml", {})


class Plugins(PluginManager):
    """The installed plugins, with one arbiter in the place of all others."""

    def __init__(self, arbiter: Callable[..., Any] | None = None) -> None:
        super().__init__()
        self._arbiter = arbiter

    def arbiter(self, name: str) -> Callable[..., Any]:
        """See `PluginManager.arbiter`."""
        return self._arbiter or super().arbiter(name)


def executive(
    journal: Journal, fleet: Fleet = NOTHING, arbiter: Callable[..., Any] | None = None
) -> Executive:
    """One on the wall clock, whose vehicles send no telemetry."""
    return Executive(fleet, journal, Plugins(arbiter), SystemClock(), watch_links=False)


def opened(kind: str, folder: Path) -> Journal:
    """A journal: "memory", or "sqlite" in the folder."""
    return MemoryJournal() if kind == "memory" else SqliteJournal.open(folder / "journal.db")


def asking(name: str) -> str:
    """A user task."""
    return f'<userTask id="{name}"/>'


def flows(*paths: Iterable[str]) -> str:
    """Sequence flows along each path."""
    return "".join(
        f'<sequenceFlow id="{flow.source}_{flow.target}"'
        f' sourceRef="{flow.source}" targetRef="{flow.target}"/>'
        for names in paths
        for flow in path(*names)
    )


def waiting(count: int, roots: str = "", more: str = "") -> bytes:
    """`count` tokens, each at a user task of its own; `more` is in the process beside them."""
    names = [f"u{number}" for number in range(count)]
    tasks = "".join(map(asking, names))
    ways = flows(["start", "fork"], *(["fork", name] for name in names))
    return file(
        f'{roots}<process id="BENCH" isExecutable="true"><startEvent id="start"/>'
        f'<parallelGateway id="fork"/>{tasks}{ways}{more}</process>'
    )
