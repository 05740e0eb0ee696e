"""Standard output and input for asyncio: a slow terminal or pipe never delays a mission."""

import asyncio
import codecs
import os
import select
import signal
import threading
import time
import weakref
from collections.abc import AsyncIterator, Callable
from contextlib import suppress
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


STDIN = 0
BACKGROUND_POLL_S = 0.5


class Lines:
    """Lines as they are typed, without their ends; iteration stops at the end of the input.

    A thread reads the descriptor itself: it may wait for ever, and must then neither hold up the
    event loop nor keep the program from ending, which a lock on `sys.stdin` would.
    """

    def __init__(self, descriptor: int = STDIN) -> None:
        self._descriptor = descriptor

    async def __aiter__(self) -> AsyncIterator[str]:
        loop = asyncio.get_running_loop()
        lines: asyncio.Queue[str | None] = asyncio.Queue()
        with suppress(ValueError):  # not in the main thread: the program around us decides
            # Read from in the background, a terminal would stop the whole executive.
            signal.signal(signal.SIGTTIN, signal.SIG_IGN)
        read = threading.Thread(
            target=self._read, args=(loop, lines), name="standard input", daemon=True
        )
        read.start()
        while (line := await lines.get()) is not None:
            yield line

    def _read(self, loop: asyncio.AbstractEventLoop, lines: "asyncio.Queue[str | None]") -> None:
        decoder = codecs.getincrementaldecoder("utf-8")("replace")
        rest = ""
        with suppress(RuntimeError):  # the loop is closed
            while block := self._block():
                *whole, rest = (rest + decoder.decode(block)).split("\n")
                for line in whole:
                    loop.call_soon_threadsafe(lines.put_nowait, line.removesuffix("\r"))
            if rest:
                loop.call_soon_threadsafe(lines.put_nowait, rest)
            loop.call_soon_threadsafe(lines.put_nowait, None)

    def _block(self) -> bytes:
        """Read the next bytes; b"" at the end."""
        while True:
            try:
                return os.read(self._descriptor, 65_536)
            except BlockingIOError:  # the parent process has made it non-blocking
                select.select([self._descriptor], [], [])
            except OSError:
                if not self._in_background():
                    return b""
                time.sleep(BACKGROUND_POLL_S)

    def _in_background(self) -> bool:
        try:
            return os.tcgetpgrp(self._descriptor) != os.getpgrp()
        except OSError:
            return False
