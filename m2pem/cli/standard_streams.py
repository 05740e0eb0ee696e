"""Standard output for asyncio: a slow terminal or pipe never delays a mission."""

import threading
import weakref
from collections.abc import Callable
from typing import TextIO

MAX_WAITING = 100_000
"""Lines that may wait before a producer of many lines should wait."""


class LineWriter:
    """Writes whole lines to a stream, in order, each batch flushed. Get one with `writer_for`."""

    def __init__(self, stream: TextIO) -> None:
        self.broken = False
        self._stream = stream
        self._changed = threading.Condition()
        self._waiting: list[str] = []
        self._printing = 0
        self._when_broken: list[Callable[[], None]] = []
        # A daemon: one that is stuck in a write must not keep the program from ending.
        threading.Thread(target=self._write, name="printing", daemon=True).start()

    def put(self, line: str) -> None:
        """Print a line later, from the thread; return at once."""
        with self._changed:
            self._waiting.append(line)
            if len(self._waiting) == 1:
                self._changed.notify_all()

    @property
    def full(self) -> bool:
        """Whether a producer of many lines should wait (`drain`)."""
        return len(self._waiting) >= MAX_WAITING

    def when_broken(self, call: Callable[[], None]) -> None:
        """Call this, from another thread, when the stream's reader has ended."""
        self._when_broken.append(call)

    def drain(self, timeout_s: float | None = None) -> None:
        """Wait until all is printed, at most `timeout_s`."""
        with self._changed:
            self._changed.wait_for(lambda: not self._waiting and not self._printing, timeout_s)

    def _write(self) -> None:
        while True:
            with self._changed:
                self._printing = 0
                self._changed.notify_all()
                self._changed.wait_for(lambda: self._waiting)
                lines, self._waiting = self._waiting, []
                self._printing = len(lines)
            if not self.broken:
                self._print(lines)

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
