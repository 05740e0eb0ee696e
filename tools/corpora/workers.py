"""Examines files in a process of its own, so that a crash or a hang costs one file."""

import multiprocessing
import resource
from collections.abc import Callable, Iterable, Iterator
from multiprocessing.connection import Connection
from pathlib import Path

from tools.corpora.examination import Examination, Outcome, examine

LIMIT_S = 120.0
"""How long one file may take before it counts as a hang. Most take milliseconds."""

MEMORY_BYTES = 4 * 1024**3

Examine = Callable[[Path], Examination]


def examine_all(
    paths: Iterable[Path], limit_s: float = LIMIT_S, examine_one: Examine = examine
) -> Iterator[tuple[Path, Examination]]:
    """Each file with what became of it, in order."""
    worker: _Worker | None = None
    try:
        for path in paths:
            worker = worker or _Worker(examine_one)
            found, alive = worker.examine(path, limit_s)
            yield path, found
            if not alive:
                worker = None
    finally:
        if worker is not None:
            worker.stop()


class _Worker:
    def __init__(self, examine_one: Examine) -> None:
        context = multiprocessing.get_context("spawn")
        self._connection, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs, examine_one), daemon=True)
        self._process.start()
        theirs.close()
        self._connection.recv()  # it has started, which is not the file's fault

    def examine(self, path: Path, limit_s: float) -> tuple[Examination, bool]:
        """What became of a file, and whether the worker can go on."""
        self._connection.send(path)
        if not self._connection.poll(limit_s):
            self.stop()
            return _lost(f"it hangs: it is not done after {limit_s:g} s"), False
        try:
            found = self._connection.recv()
        except EOFError:
            self._process.join()
            return _lost(f"it crashes the interpreter (status {self._process.exitcode})"), False
        assert isinstance(found, Examination)
        return found, True

    def stop(self) -> None:
        self._process.kill()
        self._process.join()
        self._connection.close()


def _lost(why: str) -> Examination:
    return Examination(Outcome.LOADED, problems=(why,))


def _serve(connection: Connection, examine_one: Examine) -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    connection.send("ready")
    while True:
        try:
            path = connection.recv()
        except (EOFError, KeyboardInterrupt):
            return
        connection.send(examine_one(path))
