"""Taking up the runs that another executive has left without ending them."""

import asyncio
import logging
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial

from m2pem.allocation.assignment import load_solver
from m2pem.api.clock import SystemClock
from m2pem.api.runs import RunId
from m2pem.engine.commands import CancelBehavior, Command, HoldResource
from m2pem.engine.inputs import StopRun
from m2pem.engine.run import MissionRun
from m2pem.errors import JournalError, M2pemError, OperatorError
from m2pem.executive.control_requests import control_of
from m2pem.executive.recovery import claim, replay, take_over
from m2pem.executive.runner import Runner
from m2pem.executive.supervisor import Supervisor
from m2pem.findings import Severity
from m2pem.fleet.space import waits_for_space
from m2pem.journal.base import Loss
from m2pem.journal.mission import mission_of
from m2pem.monitors.run_monitors import RunMonitors
from m2pem.units import US_PER_S

log = logging.getLogger("m2pem.executive")

CLOCK_BACK_US = 2 * US_PER_S
"""A wall clock that is behind the journal by more has gone back: no leap second, and no slew."""


@dataclass(slots=True)
class _Claimed:
    """A run that is claimed and replayed, and does not know yet what its vehicles do. `commands`:
    what it still has to command, once they are known; None: they are not, or it is driven."""

    runner: Runner
    outage_s: float
    loss: Loss | None
    commands: list[Command] | None = None


class RunTakeover:
    """Takes up interrupted runs of the journal, which the supervisor drives then."""

    def __init__(self, supervisor: Supervisor) -> None:
        self._supervisor = supervisor

    async def resume(self, runs: Sequence[RunId]) -> dict[RunId, M2pemError]:
        """Take up runs that their executive left without ending them.

        Each is given what it commanded before any of them commands anything new. A run that an
        operator stops meanwhile ends what it commanded, and waits for no other one.

        Returns why some are not taken up: a JournalError if there is no such run, or an executive
        that is alive drives it; an OperatorError if it has ended.

        Raises:
            OperatorError: the arbiters are not connected yet.
        """
        supervisor = self._supervisor
        supervisor.refuse_unconnected()
        supervisor.interrupted.expect(runs)
        refused: dict[RunId, M2pemError] = {}
        claimed: dict[RunId, _Claimed] = {}
        try:
            for run in runs:
                try:
                    claimed[run] = await self._claim(run)
                except M2pemError as error:
                    refused[run] = error
            looked = [self._look(each) for each in claimed.values()]
            found = await asyncio.gather(*looked, return_exceptions=True)
            for run, raised in zip(claimed, found, strict=True):
                if isinstance(raised, M2pemError):
                    refused[run] = raised
                elif raised is not None:
                    raise raised
        finally:
            supervisor.interrupted.taken_up()
            for each in claimed.values():
                self._drive(each)
        return refused

    async def _claim(self, number: RunId) -> _Claimed:
        """Claim an interrupted run, and rebuild its state."""
        supervisor = self._supervisor
        lines = {line.run: line for line in await supervisor.journal.runs()}
        line = lines.get(number)
        if line is None:
            known = ", ".join(lines) or "none"
            raise JournalError(f"there is no run {number}; the journal has: {known}")
        if line.loss is not None and not line.loss.resumable:
            raise OperatorError(f"{number}: {line.loss}. {line.loss.remedy(number)}")
        if line.outcome is not None:
            raise OperatorError(f"{number} has ended: {line.outcome.value}")
        if line.last_seq == 0:
            raise OperatorError(f"{number} never began: start its mission again")
        epoch = await supervisor.journal.claim(number)
        mission = mission_of(line.header)
        for finding in mission.warnings:
            if finding.severity is Severity.ERROR:
                log.warning(
                    "%s goes on as it was begun, but would not begin now: %s", number, finding
                )
        run = MissionRun(mission, supervisor.fleet, number, supervisor.settings.steps_at_once)
        monitors = RunMonitors(run.state, supervisor.fleet)
        last_us = await replay(supervisor.journal, run, supervisor.settings.on_records, monitors)
        mission = run.state.mission  # the version that holds now
        if mission.chooses_resources or waits_for_space(supervisor.fleet):
            await asyncio.to_thread(load_solver)
        runner = supervisor.add(run, epoch, monitors)
        await supervisor.dispatcher.fence(number, epoch)
        taken_before, requests = control_of(run.state)
        supervisor.handover.take_up(taken_before)
        for holder in taken_before.values():
            supervisor.seen(holder)
        supervisor.control_requests.take_up(requests)
        outage_s = self._outage_s(number, last_us)
        lent = supervisor.handover.lent_to(run.state)
        taken = {
            resource: operator
            for resource, operator in supervisor.handover.taken.items()
            if resource not in lent
        }
        claim(runner, line.loss, taken, supervisor.geometries_given(mission, resumed=True))
        mark = supervisor.marks.get(number)
        if mark is not None:
            log.warning("%s was stopped before its executive ended; it stays stopped", number)
            runner.submit_stop(StopRun(mark.by, mark.reason), frozenset())
            supervisor.interrupted.stop_of(number).set()
        return _Claimed(runner, outage_s, line.loss)

    async def _look(self, claimed: _Claimed) -> None:
        """Give a claimed run what it commanded; one that is stopped is driven at once."""
        supervisor, runner = self._supervisor, claimed.runner
        stopped = supervisor.interrupted.stop_of(runner.id)
        commands = await take_over(
            runner,
            supervisor.arbiters,
            supervisor.dispatcher,
            claimed.outage_s,
            supervisor.lost,
            claimed.loss,
            stopped,
        )
        supervisor.take_up(runner)
        if claimed.loss is not None:
            await supervisor.losses.ask(runner, claimed.loss)
        claimed.commands = commands
        supervisor.interrupted.on_stop(runner.id, partial(self._drive, claimed, only_ends=True))

    def _drive(self, claimed: _Claimed, *, only_ends: bool = False) -> None:
        """Have a run go on, if it was looked at and does not yet. `only_ends`: it commands nothing
        new, as others may not have their vehicles yet."""
        supervisor, runner = self._supervisor, claimed.runner
        commands, claimed.commands = claimed.commands, None
        if commands is None:
            return
        # Only now is known what operators have: any of the runs may say so.
        for resource in supervisor.handover.lent_to(runner.run.state):
            supervisor.availability.lend(resource, runner.id)
        ends = (CancelBehavior, HoldResource)
        runner.take_up([each for each in commands if not only_ends or isinstance(each, ends)])
        supervisor.drive(runner)

    def _outage_s(self, number: RunId, last_us: int) -> float:
        """Return for how long no executive drove a run whose last input was decided at `last_us`.

        Infinite: that is not known, as the computer's clock went back since.
        """
        supervisor = self._supervisor
        by_wall = isinstance(supervisor.clock, SystemClock) and supervisor.settings.speed == 1.0
        if by_wall and time.time_ns() // 1000 < last_us - CLOCK_BACK_US:
            log.warning(
                "%s: the computer's clock is before the run's last record (%s UTC): for how long "
                "no executive drove it is not known",
                number,
                datetime.fromtimestamp(last_us / US_PER_S, UTC).strftime("%Y-%m-%d %H:%M:%S"),
            )
            return math.inf
        return max(0.0, (supervisor.clock.now_us() - last_us) / US_PER_S)
