"""Lines from standard input, for a program that also does other things."""

import asyncio
import os
import signal
import threading
from collections.abc import Callable
from contextlib import suppress


def hear_lines(hear: Callable[[str], None]) -> None:
    """Have `hear` called on the running loop with each line, until the input ends.

    In the background of a terminal, reading ends, instead of stopping the program.
    """
    with suppress(ValueError):  # not the main thread: then the signal is its business
        signal.signal(signal.SIGTTIN, signal.SIG_IGN)
    loop = asyncio.get_running_loop()
    threading.Thread(target=_read, args=(loop, hear), name="stdin", daemon=True).start()


def _read(loop: asyncio.AbstractEventLoop, hear: Callable[[str], None]) -> None:
    """`os.read`, since a reader of `sys.stdin` would hold a lock that Python's end waits for."""
    rest = b""
    with suppress(OSError, RuntimeError):  # no input; the loop is closed
        while data := os.read(0, 4096):
            *lines, rest = (rest + data).split(b"\n")
            for line in lines:
                if text := line.decode(errors="replace").strip():
                    loop.call_soon_threadsafe(hear, text)
