"""The runs that an executive takes up when it begins, until it drives them.

Until all of them have their vehicles again no run begins: it could get the vehicle of one of them.
An operator's STOP counts for them as for any other run.
"""

import asyncio
from collections import defaultdict
from collections.abc import Callable, Iterable

from m2pem.api.runs import RunId
from m2pem.errors import NotDrivenError, OperatorError
from m2pem.executive.emergency import StopMark, StopMarks


class InterruptedRuns:
    """The runs that are to be taken up, and are not driven yet. `marks` keep a stop of one."""

    def __init__(self, marks: StopMarks) -> None:
        self._marks = marks
        self._runs: tuple[RunId, ...] = ()
        self._stopped: StopMark | None = None
        self._are_taken_up = False
        self._stops: defaultdict[RunId, asyncio.Event] = defaultdict(asyncio.Event)
        self._on_stop: dict[RunId, Callable[[], None]] = {}

    def expect(self, runs: Iterable[RunId]) -> None:
        """Say which are to be taken up, as far as is known. What was stopped by a STOP of all that
        came before is taken up to stop."""
        self._runs = tuple(runs)
        if self._stopped is not None:
            self.stop_all(self._stopped.by, self._stopped.reason)

    def taken_up(self) -> None:
        """Say that all are driven, or cannot be taken up."""
        self._runs, self._stopped, self._are_taken_up = (), None, True
        self._on_stop.clear()

    def refuse_start(self) -> None:
        """Check that a run may begin.

        Raises:
            OperatorError: interrupted runs do not have their vehicles yet.
        """
        if self._runs:
            raise OperatorError(
                f"no run begins: {', '.join(self._runs)} was interrupted, and is just taken up "
                "with its vehicles; try again in a few seconds"
            )

    def refuse_request(self, run: RunId) -> None:
        """Check that a run is not about to be driven here.

        Raises:
            NotDrivenError: it is.
        """
        if run in self._runs:
            raise NotDrivenError(
                f"{run} was interrupted, and is just taken up with its vehicles; try again in a "
                "few seconds"
            )

    def stop(self, run: RunId, by: str, reason: str) -> bool:
        """Stop a run as soon as it is driven. Returns whether it is one of these."""
        if run in self._runs:
            self._marks.put(run, StopMark(by, reason))
            self._stops[run].set()
            if (call := self._on_stop.pop(run, None)) is not None:
                call()
        return run in self._runs

    def stop_of(self, run: RunId) -> asyncio.Event:
        """Return what is set when a run is stopped before it is driven."""
        return self._stops[run]

    def on_stop(self, run: RunId, call: Callable[[], None]) -> None:
        """Call once when a run is stopped before all are taken up: at once, if it is already."""
        if self._stops[run].is_set():
            call()
        else:
            self._on_stop[run] = call

    def stop_all(self, by: str, reason: str) -> list[RunId]:
        """Stop all as soon as they are driven, also those that are found later; returns them."""
        if not self._are_taken_up:
            self._stopped = StopMark(by, reason)
        return [run for run in self._runs if self.stop(run, by, reason)]
