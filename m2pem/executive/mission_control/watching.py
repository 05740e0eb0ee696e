"""What an executive says of its runs: records, telemetry, questions and summaries."""

import asyncio
from collections.abc import AsyncIterator, Sequence

from m2pem.api.mission_control.watching import ControlEvent
from m2pem.api.runs import OpenPrompt, RunId, RunSummary, StampedRecord, stamped_records
from m2pem.api.telemetry import LinkState, Telemetry
from m2pem.engine.state import RunStatus as EngineStatus
from m2pem.errors import OperatorError
from m2pem.executive.mission_control.parts import ControlParts
from m2pem.executive.run_summary import summary
from m2pem.journal.mission import present_mission_of
from m2pem.mission.mission import Mission

MANY_RUNS = 500
"""From so many on, a thread makes the summaries of runs."""


class WatchOperations(ControlParts):
    """See `m2pem.api.mission_control.watching.WatchControl`."""

    def subscribe(
        self, run: RunId | None = None, size: int = 10_000
    ) -> AsyncIterator[ControlEvent]:
        subscription = self._supervisor.events.subscribe(run, size)
        subscription.put(self.prompts())
        return subscription

    def telemetry(self, size: int = 100) -> AsyncIterator[Telemetry]:
        states = self._bus.subscribe(size)
        for resource in self._supervisor.arbiters.resources:
            state = self._bus.latest(resource)
            if state is not None and state.link is LinkState.LOST:
                states.put(state)
        return states

    async def records(
        self, run: RunId, after_seq: int = 0, limit: int = 1000
    ) -> Sequence[StampedRecord]:
        page: list[StampedRecord] = []
        async for entry in self._supervisor.journal.read(run, after_seq):
            page += stamped_records(run, entry.seq, entry.t_us / 1_000_000, entry.records)
            if len(page) >= limit:
                break
        return page

    async def runs(self) -> Sequence[RunSummary]:
        lines = await self._supervisor.journal.runs(files=False)

        def summaries() -> list[RunSummary]:
            return [summary(line) for line in lines if not line.gone]

        # Of ten thousand runs it would keep the event loop for a while.
        return summaries() if len(lines) < MANY_RUNS else await asyncio.to_thread(summaries)

    def prompts(self) -> Sequence[OpenPrompt]:
        return [
            prompt
            for runner in self._supervisor.runners.values()
            for prompt in runner.prompts.values()
        ]

    async def mission(self, run: RunId) -> Mission:
        runner = self._supervisor.runners.get(run)
        if runner is not None:
            return runner.run.state.mission
        for line in await self._supervisor.journal.runs():
            if line.run == run:
                if line.gone:
                    raise OperatorError(f"{run}: {line.loss}")
                return await present_mission_of(self._supervisor.journal, line)
        raise OperatorError(f"the journal has no run {run}")

    async def mission_time_s(self, run: RunId) -> float:
        state = self._supervisor.runner(run).run.state
        if state.status is EngineStatus.ENDED:
            raise OperatorError(f"{run} has ended")
        return max(0, state.mission_time_us(self._supervisor.clock.now_us())) / 1_000_000

    async def wait(self, run: RunId) -> RunSummary:
        runner = self._supervisor.runner(run)
        await runner.done.wait()
        if runner.failure is not None:
            raise runner.failure
        lines = {line.run: line for line in await self._supervisor.journal.runs()}
        return summary(lines[run])
