"""Standard output, while an operator's screen covers the terminal and while it does not."""

import asyncio
import io
import sys
from collections.abc import AsyncIterator

import pytest

from m2pem.api.mission_control.watching import ControlEvent
from m2pem.api.runs import LEFT_ARMED, Alert, StampedRecord
from m2pem.cli.output import Output
from m2pem.cli.standard_streams import writer_for
from m2pem.engine.records import RunEnded, RunOutcome, RunPaused


class Screen(io.StringIO):
    """A stream that is a terminal, or is not."""

    def __init__(self, *, terminal: bool) -> None:
        super().__init__()
        self._terminal = terminal

    def isatty(self) -> bool:
        return self._terminal


def told(*, terminal: bool, cover: bool) -> tuple[str, str]:
    """What is printed of a run, before the terminal is free again and after."""
    stream = Screen(terminal=terminal)
    output = Output(stream, as_json=True)
    if cover:
        output.cover()
    output.show(StampedRecord("r1", 1, 0.0, RunPaused(5)))
    output.show(StampedRecord("r1", 2, 0.0, RunEnded(RunOutcome.COMPLETED, "")))
    output.writer.drain()
    before = stream.getvalue()
    output.uncover()
    output.writer.drain()
    return before, stream.getvalue().removeprefix(before)


def test_a_covered_terminal_gets_the_end_alone_and_late() -> None:
    before, after = told(terminal=True, cover=True)
    assert before == ""
    assert [word for word in ("RunPaused", "RunEnded") if word in after] == ["RunEnded"]


def test_which_vehicles_stay_armed_is_printed_when_the_terminal_is_free_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    errors = Screen(terminal=True)
    monkeypatch.setattr(sys, "stderr", errors)
    output = Output(Screen(terminal=True), as_json=True)

    async def alerts() -> AsyncIterator[ControlEvent]:
        yield Alert("r1", "SLOW_DISK", "the journal is slow")
        yield Alert("r1", LEFT_ARMED, "uav1 stays armed in RTL")

    output.cover()
    asyncio.run(output.follow(alerts()))
    writer_for(errors).drain()
    assert errors.getvalue() == ""
    output.uncover()
    writer_for(errors).drain()
    assert errors.getvalue() == "m2pem: r1: uav1 stays armed in RTL\n"


@pytest.mark.parametrize(("terminal", "cover"), [(True, False), (False, True)])
def test_what_is_not_covered_gets_everything_at_once(terminal: bool, cover: bool) -> None:
    before, after = told(terminal=terminal, cover=cover)
    assert "RunPaused" in before
    assert "RunEnded" in before
    assert after == ""
