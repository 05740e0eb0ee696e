"""SIGINT and SIGTERM: the first ends a command in order, the second says what is waited for, and
the third ends the process at once."""

import asyncio
import os
import signal
import sys
import termios
from types import FrameType
from typing import TYPE_CHECKING, Any, Self

from m2pem.cli.group import STOPPED
from m2pem.cli.standard_streams import writer_for

if TYPE_CHECKING:
    from m2pem.executive.executive import Executive

SIGNALS = (signal.SIGINT, signal.SIGTERM)
GIVE_UP = 3
AT_ONCE_S = 0.2
"""What the last lines of a process that ends at once are given to be printed: shorter than
`m2pem.journal.lease.ABANDONED_S`."""

_LEAVE_SCREEN = b"\x1b[<u\x1b[?1004l\x1b[?2004l\x1b[?1049l\x1b[?25h\x1b[0m"
"""Ends what Textual asks of a terminal: keys and focus as events, another screen, no cursor."""


class Interruption:
    """Handles the signals from `begin` to the end of its block, which is around `asyncio.run`: so
    a signal in the middle of closing ends nothing. They are handled while a plugin blocks the event
    loop, too: each interrupts a system call of the main thread, but for one that comes just before
    that call, which the next signal brings to light.

    `asked`: set when all must end. `closing`: what is waited for when no vehicle is.
    """

    def __init__(self, closing: str = "the journal") -> None:
        self.asked = asyncio.Event()
        self.executive: Executive | None = None
        """Its runs are stopped."""
        self._closing = closing
        self._count = 0
        self._before: dict[signal.Signals, Any] = {}
        """Of the block: `asyncio.run` has a handler of its own for SIGINT."""
        self._stopping: asyncio.Task[None] | None = None
        self._terminal: list[Any] | None = None
        self._errors = sys.stderr
        """Itself: a unit that has the terminal puts another one in its place."""
        self._loop: asyncio.AbstractEventLoop | None = None

    def __enter__(self) -> Self:
        self._before = {number: signal.getsignal(number) for number in SIGNALS}
        return self

    def __exit__(self, *reason: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def begin(self) -> None:
        """Handle signals in the running event loop from now on; before, one ends the process."""
        self._loop = asyncio.get_running_loop()
        for number in SIGNALS:
            signal.signal(number, self._received)

    def take_terminal(self) -> None:
        """Note how the terminal is, before a unit draws on the whole of it."""
        self._terminal = termios.tcgetattr(sys.stdin.fileno())

    def stop(self, reason: str) -> None:
        """Stop every run; the executive waits until the vehicles are released."""
        self.asked.set()
        if self._stopping is None and self.executive is not None:
            self._stopping = asyncio.create_task(self.executive.stop_all(reason))

    def _received(self, number: int, _: FrameType | None) -> None:
        self._count += 1
        name = signal.Signals(number).name
        if self._count == 1:
            if self._loop is not None and not self._loop.is_closed():
                self._loop.call_soon_threadsafe(self.stop, f"stopped by {name}")
            if held := self._held():
                self._say(f"{name}: stopping; waiting for {held}")
        elif self._count < GIVE_UP:
            held = self._held() or self._closing
            self._say(f"{name}: still waiting for {held}; once more to give up")
        else:
            for each in SIGNALS:  # one that comes again would begin this again
                signal.signal(each, signal.SIG_IGN)
            held = self._held() or "nothing"
            self.end_at_once(f"{name}: gave up; not released: {held}", STOPPED)

    def end_at_once(self, text: str, status: int) -> None:
        """Say why, and end the process, from any thread: nothing is closed; locks end with it."""
        if self._terminal is not None:
            os.write(self._errors.fileno(), _LEAVE_SCREEN)
            termios.tcsetattr(sys.stdin.fileno(), termios.TCSANOW, self._terminal)
        writer = writer_for(self._errors)
        writer.put(f"m2pem: {text}")
        writer.drain(AT_ONCE_S)
        os._exit(status)

    def _held(self) -> str:
        """The resources that runs still command."""
        runners = self.executive.runners.values() if self.executive is not None else ()
        held = {
            resource: None
            for runner in runners
            if not runner.done.is_set()
            for resource in runner.run.state.held
        }
        return ", ".join(held)

    def _say(self, text: str) -> None:
        # From a thread: a full pipe at standard error must not delay the stop.
        writer_for(sys.stderr).put(f"m2pem: {text}")
