"""Small files beside a journal that tell the next executive what its journal does not say.

They are written by threads of their own: nothing waits for a disk that hangs.
"""

import asyncio
import json
import logging
import threading
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from queue import Queue
from typing import Any
from uuid import UUID

from m2pem.executive.runtime_directory import runtime_directory
from m2pem.whole_file import write_whole

CLOSED_WITHIN_S = 1.0

log = logging.getLogger("m2pem.executive")


class MarkFiles:
    """The marks of one kind of a journal, each with a name and a content.

    `file`: where the journal is; None: in memory, as the marks are then. `identity`: of the
    journal, so that the marks of a removed journal do not count for the next one at its place.
    """

    def __init__(self, file: Path | None, identity: UUID, kind: str) -> None:
        self._identity = str(identity)
        self._kind = kind
        self._put: dict[str, Mapping[str, Any]] = {}
        self._places: dict[str, Queue[tuple[Path, bytes | None]]] = {}
        if file is not None:
            self._places[f"{file}-{kind}-"] = Queue()
            with suppress(OSError):
                self._places[f"{runtime_directory()}/{identity}-{kind}-"] = Queue()
        self._started = False

    def put(self, name: str, content: Mapping[str, Any]) -> None:
        """Have a mark written, of what JSON has; returns at once."""
        self._put[name] = content
        self._queue(name, json.dumps({"journal": self._identity, **content}).encode())

    def remove(self, name: str) -> None:
        """Have a mark removed; returns at once."""
        self._put.pop(name, None)
        if self._started:
            self._queue(name, None)

    def get(self, name: str) -> Mapping[str, Any] | None:
        """Return the content of a mark; None: there is none of that name."""
        if (content := self._put.get(name)) is not None:
            return content
        for place in self._places:
            try:
                found = json.loads(Path(f"{place}{name}").read_bytes())
            except (OSError, ValueError):
                continue
            if isinstance(found, dict) and found.get("journal") == self._identity:
                self._start()  # there is something to remove
                return found
        return None

    def files(self, name: str) -> list[Path]:
        """Return the files that a mark has, if it is there."""
        return [Path(f"{place}{name}") for place in self._places]

    async def close(self) -> None:
        """Wait until what was asked for is done, at most `CLOSED_WITHIN_S`: a disk may hang."""
        if self._started:
            with suppress(TimeoutError):
                async with asyncio.timeout(CLOSED_WITHIN_S):
                    # Not in a thread that waits: the program would wait for that one in the end.
                    while any(queue.unfinished_tasks for queue in self._places.values()):  # noqa: ASYNC110
                        await asyncio.sleep(0.01)

    def _queue(self, name: str, content: bytes | None) -> None:
        self._start()
        for place, queue in self._places.items():
            queue.put((Path(f"{place}{name}"), content))

    def _start(self) -> None:
        if self._started:
            return
        self._started = True
        for queue in self._places.values():
            # A thread for each place, as one may hang; a daemon, as a hanging one must not keep
            # the program from ending.
            name = f"marks: {self._kind}"
            threading.Thread(target=_serve, args=(queue,), name=name, daemon=True).start()


def _serve(queue: "Queue[tuple[Path, bytes | None]]") -> None:
    while True:
        path, content = queue.get()
        try:
            if content is None:
                path.unlink(missing_ok=True)
            else:
                write_whole(path, content)
        except OSError as error:
            log.warning("%s: it cannot be written or removed: %s", path, error.strerror)
        finally:
            queue.task_done()
