"""Marks of runs that an operator stopped, kept outside the journal until it has the stop.

A STOP goes to the vehicles before the journal has it. If the executive then dies while the disk
does not answer, the journal still says that the run goes on; the mark says that it must not. It is
written to two places, as one of them may be on the disk that fails: beside the journal, and in the
runtime folder, which is in memory on most systems. Writing never holds up the executive.
"""

import asyncio
import json
import logging
import os
import threading
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from queue import Queue
from uuid import UUID

from m2pem.executive.runtime_folder import runtime_folder

CLOSED_WITHIN_S = 1.0

log = logging.getLogger("m2pem.executive")


@dataclass(frozen=True, slots=True)
class StopMark:
    """Who stopped a run, and why."""

    by: str
    reason: str


class StopMarks:
    """The marks of one journal. `file`: where the journal is; None: in memory, no mark is kept.

    `identity`: of the journal, so that the marks of a removed journal do not stop the runs of the
    next one at its place.
    """

    def __init__(self, file: Path | None, identity: UUID) -> None:
        self._identity = str(identity)
        self._places: dict[str, Queue[tuple[Path, bytes | None]]] = {}
        if file is not None:
            self._places[f"{file}-stopped-"] = Queue()
            with suppress(OSError):
                self._places[f"{runtime_folder()}/{identity}-stopped-"] = Queue()
        self._started = False

    def put(self, run: str, mark: StopMark) -> None:
        """Have a mark written; returns at once."""
        content = {"journal": self._identity, "by": mark.by, "reason": mark.reason}
        self._queue(run, json.dumps(content).encode())

    def remove(self, run: str) -> None:
        """Have the mark of a run removed: the journal has the stop; returns at once."""
        if self._started:
            self._queue(run, None)

    def get(self, run: str) -> StopMark | None:
        """The mark of a run that was left without an end; None: it was not stopped."""
        for place in self._places:
            try:
                content = json.loads(Path(f"{place}{run}").read_bytes())
            except (OSError, ValueError):
                continue
            if content.get("journal") == self._identity:
                self._start()  # there is something to remove
                return StopMark(str(content.get("by", "")), str(content.get("reason", "")))
        return None

    async def close(self) -> None:
        """Wait until what was asked for is done, at most `CLOSED_WITHIN_S`: a disk may hang."""
        if self._started:
            with suppress(TimeoutError):
                async with asyncio.timeout(CLOSED_WITHIN_S):
                    # Not in a thread that waits: the program would wait for that one in the end.
                    while any(queue.unfinished_tasks for queue in self._places.values()):  # noqa: ASYNC110
                        await asyncio.sleep(0.01)

    def _queue(self, run: str, content: bytes | None) -> None:
        self._start()
        for place, queue in self._places.items():
            queue.put((Path(f"{place}{run}"), content))

    def _start(self) -> None:
        if self._started:
            return
        self._started = True
        for queue in self._places.values():
            # A thread for each place, as one may hang; a daemon, as a hanging one must not keep
            # the program from ending.
            threading.Thread(target=_serve, args=(queue,), name="stop marks", daemon=True).start()


def _serve(queue: "Queue[tuple[Path, bytes | None]]") -> None:
    while True:
        path, content = queue.get()
        try:
            if content is None:
                path.unlink(missing_ok=True)
            else:
                _write(path, content)
        except OSError as error:
            log.warning("%s: the mark of a stopped run: %s", path, error.strerror)
        finally:
            queue.task_done()


def _write(path: Path, content: bytes) -> None:
    new = path.with_name(f"{path.name}.new")
    descriptor = os.open(new, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW, 0o600)
    try:
        os.write(descriptor, content)
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
    new.rename(path)
