"""SIGINT and SIGTERM: one stops cleanly, a second says what is waited for, a third gives up."""

import asyncio
import os
import signal
import sys
from types import TracebackType
from typing import Self

from m2pem.cli.entry import STOPPED
from m2pem.cli.writer import writer_for
from m2pem.executive.executive import Executive

SIGNALS = (signal.SIGINT, signal.SIGTERM)
GIVE_UP = 3
GIVE_UP_PRINTING_S = 1.0


class Interruption:
    """Watches the signals within its block. `asked` is set when everything is to stop."""

    def __init__(self, executive: Executive) -> None:
        self.asked = asyncio.Event()
        self._executive = executive
        self._count = 0
        self._stopping: asyncio.Task[None] | None = None

    def __enter__(self) -> Self:
        loop = asyncio.get_running_loop()
        for number in SIGNALS:
            loop.add_signal_handler(number, self._received, number)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        loop = asyncio.get_running_loop()
        for number in SIGNALS:
            loop.remove_signal_handler(number)

    def stop(self, reason: str) -> None:
        """Stop every run; what follows waits until the vehicles are released."""
        self.asked.set()
        if self._stopping is None:
            self._stopping = asyncio.create_task(self._executive.stop_all(reason))

    def _received(self, number: signal.Signals) -> None:
        self._count += 1
        name = signal.Signals(number).name
        if self._count == 1:
            self.stop(f"stopped by {name}")
            if self._held():
                self._say(f"{name}: stopping; waiting for {self._held()}")
        elif self._count < GIVE_UP:
            held = self._held() or "the journal"
            self._say(f"{name}: still waiting for {held}; once more to give up")
        else:
            self._say(f"{name}: gave up; not released: {self._held() or 'nothing'}")
            writer_for(sys.stderr).drain(GIVE_UP_PRINTING_S)
            os._exit(STOPPED)

    def _held(self) -> str:
        """The resources that runs still command."""
        held = {
            resource: None
            for runner in self._executive.runners.values()
            if not runner.done.is_set()
            for resource in runner.run.state.held
        }
        return ", ".join(held)

    def _say(self, text: str) -> None:
        # From a thread: standard error that nobody reads must not hold up the stop.
        writer_for(sys.stderr).put(f"m2pem: {text}")
