"""Follows the runs of an executive, and makes traces and measures of them."""

import asyncio
from collections.abc import Callable
from contextlib import suppress

from m2pem.api import records as r
from m2pem.api.control import MissionControl
from m2pem.api.follower import Listener, follow
from m2pem.api.log_context import trace_ids
from m2pem.api.run_view import RunView
from m2pem.api.runs import RunId, StampedRecord
from m2pem.errors import M2pemError
from m2pem_plugin_opentelemetry.run_measures import RunMeasures
from m2pem_plugin_opentelemetry.run_trace import RunTrace
from m2pem_plugin_opentelemetry.spans import Span

LOST_EACH_S = 1.0
"""Between two attempts to follow the executive again."""

ENDED_WITHIN_S = 2.0
"""How long, after it was cancelled, the last records of runs that end just now are read."""

LOOK_EACH_S = 0.05


class RunObservation(Listener):
    """Traces of all runs that have not ended when it is made, and of those that begin.

    `on_span` gets each span that ends, also those of before a restart, which are made again; None:
    runs are measured alone. What ended before is not measured again: it was, by the executive of
    then.
    """

    def __init__(
        self, control: MissionControl, on_span: Callable[[Span], None] | None = None
    ) -> None:
        self.measures = RunMeasures()
        self._on_span = on_span
        self._traces: dict[RunId, RunTrace] = {}
        self._is_new = False
        self._follower = follow(control, self)

    async def run(self) -> None:
        """Observe until cancelled, or until the executive ends."""
        while True:
            try:
                return await self._follower.run()
            except M2pemError:
                await asyncio.sleep(LOST_EACH_S)

    async def finish(self) -> None:
        """After `run` was cancelled: observe what ends now, within `ENDED_WITHIN_S`."""
        following = asyncio.create_task(self._follower.run())
        with suppress(TimeoutError):
            async with asyncio.timeout(ENDED_WITHIN_S):
                await asyncio.sleep(0)
                while self._traces and not following.done():  # noqa: ASYNC110  # any record may
                    await asyncio.sleep(LOOK_EACH_S)
        following.cancel()
        await asyncio.gather(following, return_exceptions=True)
        for run in self._traces:
            trace_ids.pop(run, None)

    def recorded(self, view: RunView, stamped: StampedRecord, *, is_new: bool) -> None:
        """See `Listener`."""
        trace = self._traces.get(view.run)
        if trace is None:
            if not isinstance(stamped.record, r.RunStarted) or view.seq != stamped.seq:
                return  # of a run that is over
            trace = self._traces[view.run] = RunTrace(
                view, stamped.record, self._ended, whole=self._on_span is not None
            )
            if self._on_span is not None:
                trace_ids[view.run] = f"{trace.trace_id:032x}"
        self._is_new = is_new
        trace.apply(stamped)
        if trace.is_over:
            del self._traces[view.run]
            if self._on_span is not None:
                trace_ids.pop(view.run, None)

    def _ended(self, span: Span, record: r.Record) -> None:
        if self._is_new:
            self.measures.count(span, record)
        if self._on_span is not None:
            self._on_span(span)
