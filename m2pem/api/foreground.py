"""Parts of commands that run until Ctrl-C, such as simulators: how they end, and what is typed."""

import asyncio
import codecs
import os
import select
import signal
import threading
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import suppress
from typing import Any, ClassVar

import click

from m2pem.api.faults import FaultError, FaultGrammar, PlannedFault
from m2pem.api.latest_task import cancel_and_wait


def interrupted() -> asyncio.Event:
    """Return an event that SIGINT (Ctrl-C) and SIGTERM set from now on, in place of ending the
    program. Call it on the running loop."""
    event = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(number, event.set)
    return event


async def until_interrupted(
    stop: asyncio.Event, ends: Awaitable[None], *beside: Awaitable[None]
) -> None:
    """Wait until `stop` is set or `ends` is over, and cancel `ends` and `beside`.

    Raises:
        Exception: what `ends` raises.
    """
    ended, stopped, *others = (asyncio.ensure_future(each) for each in (ends, stop.wait(), *beside))
    try:
        await asyncio.wait((ended, stopped), return_when=asyncio.FIRST_COMPLETED)
        if ended.done():
            ended.result()
    finally:
        await cancel_and_wait(ended, stopped, *others)


STDIN = 0
BACKGROUND_POLL_S = 0.5


class Lines:
    """Lines as they are typed, without their ends; iteration stops at the end of the input.

    A thread reads the descriptor itself: it may wait for ever, and must then neither hold up the
    event loop nor keep the program from ending, which a lock on `sys.stdin` would. Who reads the
    same descriptor after another one of this event loop goes on with its thread: no line is lost.
    """

    _reading: ClassVar[dict[int, tuple[asyncio.AbstractEventLoop, asyncio.Queue[str | None]]]] = {}

    def __init__(self, descriptor: int = STDIN) -> None:
        self._descriptor = descriptor

    async def __aiter__(self) -> AsyncIterator[str]:
        loop = asyncio.get_running_loop()
        reading, lines = self._reading.get(self._descriptor, (None, asyncio.Queue()))
        if reading is not loop:
            lines = asyncio.Queue()
            self._reading[self._descriptor] = loop, lines
            self._begin(loop, lines)
        while (line := await lines.get()) is not None:
            yield line
        self._reading.pop(self._descriptor, None)

    def _begin(self, loop: asyncio.AbstractEventLoop, lines: "asyncio.Queue[str | None]") -> None:
        with suppress(ValueError):  # not in the main thread: the program around us decides
            # Read from in the background, a terminal would stop the whole executive.
            signal.signal(signal.SIGTTIN, signal.SIG_IGN)
        read = threading.Thread(
            target=self._read, args=(loop, lines), name="standard input", daemon=True
        )
        read.start()

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


async def plan_typed_faults(
    grammar: FaultGrammar[Any], plan: Callable[[PlannedFault[Any]], None]
) -> None:
    """Plan the faults that are typed, until the input ends."""
    async for line in Lines():
        if not (text := line.strip()):
            continue
        try:
            plan(grammar.parse(text))
        except FaultError as error:
            click.echo(f"m2pem: {error}", err=True)
        else:
            click.echo(f"fault: {text}")
