"""Prints committed records: each as a line for people, or as JSON."""

import asyncio
import os
import sys
from collections.abc import AsyncIterator, Callable, Collection, Iterator
from contextlib import contextmanager
from typing import TextIO

from m2pem.api.description import printable
from m2pem.api.mission_control.watching import ControlEvent
from m2pem.api.requirement_states import RequirementState, in_short
from m2pem.api.runs import LEFT_ARMED, LOGGED, Alert, RunId, StampedRecord
from m2pem.cli.line_formatter import LineFormatter
from m2pem.cli.requirement_table import requirement_table
from m2pem.cli.standard_streams import LineWriter, writer_for
from m2pem.engine.records import RunEnded
from m2pem.journal.codec import record_line
from m2pem.mission.mission import Mission
from m2pem.units import US_PER_S

TURN = 200
"""Records printed before other tasks may run."""


def wants_colour(stream: TextIO) -> bool:
    """Whether a stream is a terminal whose owner has not set NO_COLOR."""
    return stream.isatty() and not os.environ.get("NO_COLOR")


class Output:
    """Standard output, for records. Made by `output_of`."""

    def __init__(self, stream: TextIO, *, as_json: bool) -> None:
        self.lines: LineFormatter | None = None
        self._stream = stream
        self._as_json = as_json
        self._covered = False
        self._kept: list[tuple[TextIO, str]] = []
        self.writer: LineWriter = writer_for(stream)

    @property
    def shown_to_a_person(self) -> bool:
        """Whether records are printed on a terminal."""
        return self._stream.isatty()

    def format_with(
        self, mission: Callable[[RunId], Mission | None], *, one: bool, asks: bool
    ) -> None:
        """Set how records become lines, as for `LineFormatter`; then they can be printed."""
        self.lines = LineFormatter(mission, colour=wants_colour(self._stream), one=one, asks=asks)

    def cover(self) -> None:
        """An operator's screen covers the terminal. How runs end, and which vehicles stay armed
        then, is kept for `uncover`."""
        self._covered = self._stream.isatty()

    def uncover(self) -> None:
        """The terminal is free again."""
        self._covered = False
        for stream, line in self._kept:
            writer_for(stream).put(line)
        self._kept.clear()

    def show(self, stamped: StampedRecord) -> None:
        """Print a record."""
        line = self._line(stamped)
        if line is None:
            return
        if not self._covered:
            self.writer.put(line)
        elif isinstance(stamped.record, RunEnded):
            self._kept.append((self._stream, line))

    def _line(self, stamped: StampedRecord) -> str | None:
        if self._as_json:
            t_us = round(stamped.t_s * US_PER_S)
            return record_line(stamped.run, stamped.seq, t_us, stamped.record).decode()
        assert self.lines is not None
        return self.lines.format(stamped)

    def summarize(self, run: RunId, requirements: Collection[RequirementState]) -> None:
        """Print for people what became of the requirements of a run that is over."""
        if requirements and not self._as_json:
            self.writer.put(f"\nrequirements of {run}: {in_short(requirements)}")
            self.writer.put(requirement_table(requirements))

    async def follow(self, notices: AsyncIterator[ControlEvent]) -> None:
        """Print every record, until the subscription ends."""
        printed = 0
        async for notice in notices:
            printed += 1
            if printed % TURN == 0:
                await asyncio.sleep(0)  # a backlog comes without waiting, and STOP must not wait
                if self.writer.full:
                    await self.drain()
            if isinstance(notice, StampedRecord):
                self.show(notice)
            elif isinstance(notice, Alert) and notice.code != LOGGED:
                self._warn(notice)

    def _warn(self, alert: Alert) -> None:
        where = f"{alert.run}: " if alert.run else ""
        line = f"m2pem: {where}{printable(alert.text)}"
        if not self._covered:
            writer_for(sys.stderr).put(line)
        elif alert.code == LEFT_ARMED:
            self._kept.append((sys.stderr, line))

    async def drain(self) -> None:
        """Wait until all is printed."""
        await asyncio.to_thread(self.writer.drain)


@contextmanager
def output_of(wanted: str) -> Iterator[Output]:
    """The output in a format, `text` or `json`.

    With `json`, OCUs and plugins print to standard error within the block.
    """
    stdout = sys.stdout
    as_json = wanted == "json"
    reconfigure = getattr(stdout, "reconfigure", None)
    if reconfigure is not None:
        reconfigure(**({"encoding": "utf-8"} if as_json else {"errors": "replace"}))
    if as_json:
        sys.stdout = sys.stderr
    try:
        yield Output(stdout, as_json=as_json)
    finally:
        sys.stdout = stdout
