"""Prints lines from a thread, so that a reader who stands still never holds up a mission."""

import queue
import threading
import weakref
from collections.abc import Callable
from typing import TextIO

MAX_WAITING = 100_000
"""Lines that may wait before whoever prints many ought to wait too."""


class LineWriter:
    """Writes whole lines to a stream, in order, each batch flushed. Get one with `writer_for`."""

    def __init__(self, stream: TextIO) -> None:
        self.broken = False
        self._stream = stream
        self._waiting: queue.Queue[str] = queue.Queue()
        self._when_broken: list[Callable[[], None]] = []
        # A daemon: one that is stuck in a write must not keep the program from ending.
        threading.Thread(target=self._write, name="printing", daemon=True).start()

    def put(self, line: str) -> None:
        """Have a line printed; returns at once."""
        self._waiting.put(line)

    @property
    def full(self) -> bool:
        """Whether so much waits that whoever prints many lines ought to wait."""
        return self._waiting.qsize() >= MAX_WAITING

    def when_broken(self, call: Callable[[], None]) -> None:
        """Call this, from another thread, when nobody reads the stream any more."""
        self._when_broken.append(call)

    def drain(self, timeout_s: float | None = None) -> None:
        """Wait until all is printed, at most `timeout_s`."""
        with self._waiting.all_tasks_done:
            self._waiting.all_tasks_done.wait_for(
                lambda: not self._waiting.unfinished_tasks, timeout_s
            )

    def _write(self) -> None:
        while True:
            lines = [self._waiting.get()]
            while len(lines) < MAX_WAITING and not self._waiting.empty():
                lines.append(self._waiting.get())
            if not self.broken:
                self._print(lines)
            for _ in lines:
                self._waiting.task_done()

    def _print(self, lines: list[str]) -> None:
        try:
            self._stream.write("".join(f"{line}\n" for line in lines))
            self._stream.flush()
        except (OSError, ValueError):  # a closed pipe, a closed stream
            self.broken = True
            for call in self._when_broken:
                call()


_writers: "weakref.WeakKeyDictionary[TextIO, LineWriter]" = weakref.WeakKeyDictionary()


def writer_for(stream: TextIO) -> LineWriter:
    """The one writer of a stream: lines of several users come out in the order of their `put`."""
    writer = _writers.get(stream)
    if writer is None:
        writer = _writers[stream] = LineWriter(stream)
    return writer
