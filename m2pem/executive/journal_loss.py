"""Resuming a run of which the journal has lost entries: hold, ask, and only then go on.

The vehicles may execute behaviors that the journal does not know. So those are cancelled, all that
the mission allocates is held, the run is paused, and a question to the operators is opened. The
question belongs to the executive, not to the mission; the mark file remembers the loss until it
is answered, so that a second crash asks again.
"""

import asyncio
import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from m2pem.api.arbiter import Arbiter, BehaviorReport
from m2pem.api.runs import OpenPrompt, PromptClosed, RunId
from m2pem.engine.commands import RunService
from m2pem.engine.inputs import BehaviorMissing, Input
from m2pem.engine.records import BehaviorRequested, Record, RunEnded, RunResumed
from m2pem.engine.state import Behavior, BehaviorPhase
from m2pem.errors import OperatorError
from m2pem.executive.control_events import ControlEvents
from m2pem.executive.dispatcher import Dispatcher
from m2pem.executive.fleet_connections import FleetArbiters
from m2pem.executive.handover import Handover
from m2pem.executive.runner import Runner
from m2pem.fleet.allocation import Availability, is_behavior, resources_of_mission
from m2pem.journal.base import Journal, Loss
from m2pem.mission.behavior import Decision
from m2pem.mission.catalogue import BehaviorState, ResourceId, ResumePolicy

log = logging.getLogger("m2pem.resume")

PROMPT = "loss"
"""The id of the question, beside the mission's own p1, p2, ..."""

DECISIONS = (Decision("go_on", "Go on"), Decision("stop", "Stop the mission"))

PROBED = 50
"""At most so many behaviors that the journal may have lost are asked for at the arbiters."""

CALL_TIMEOUT_S = 10.0

_UNDER_WAY = (BehaviorState.ACCEPTED, BehaviorState.RUNNING)


def doubted(
    behavior: Behavior, report: BehaviorReport | None, item: Input | None, loss: Loss
) -> Input | None:
    """What to post of a known behavior in place of `item`: it is held and an operator asked, unless
    it has ended or cannot be reached."""
    if report is None or report.state.terminal or behavior.phase is not BehaviorPhase.ACTIVE:
        return item
    return BehaviorMissing(behavior.id, ResumePolicy.HOLD, report.state, str(loss))


def paused_by(loss: Loss) -> str:
    """Who pauses the run, for its records and for operators."""
    return f"m2pem, because {loss}"


@dataclass(eq=False)
class JournalLossPrompts:
    """The questions about losses that are open in one executive."""

    _journal: Journal
    _arbiters: FleetArbiters
    _dispatcher: Dispatcher
    _availability: Availability
    _handover: Handover
    _events: ControlEvents
    _runners: Mapping[RunId, Runner]
    _held: dict[RunId, tuple[ResourceId, ...]] = field(default_factory=dict)
    _services: dict[RunId, tuple[RunService, ...]] = field(default_factory=dict)

    async def ask(self, runner: Runner, loss: Loss) -> None:
        """Cancel what the journal does not know, hold what the mission allocates, and ask.

        Services that the run waits for begin again when it goes on.
        After the takeover, before the run is driven.
        """
        log.error("%s: %s; its vehicles are held and an operator is asked", runner.id, loss)
        held = self._held[runner.id] = tuple(self._allocated(runner))
        for resource in held:
            self._dispatcher.hold(resource)
            self._availability.withdraw(resource, f"held: an operator is asked of {runner.id}")
        self._services[runner.id] = tuple(
            each for each in runner.run.outstanding() if isinstance(each, RunService)
        )
        unknown = await self._cancel_unknown(runner, loss)
        prompt = OpenPrompt(
            runner.id,
            PROMPT,
            runner.run.state.root.container.process.id if runner.run.state.root else "",
            _text(runner.id, loss, held, unknown),
            DECISIONS,
        )
        runner.prompts[PROMPT] = prompt
        self._events.publish(prompt)

    def is_open(self, run: RunId) -> bool:
        """Whether operators are being asked about a loss of this run."""
        return run in self._held

    def on_records(self, run: RunId, records: Sequence[Record]) -> None:
        """Records were committed: the question is closed when the run goes on or has ended."""
        if run not in self._held:
            return
        runner = self._runners[run]
        for record in records:
            match record:
                case RunResumed(by=by):
                    open_ = runner.run.state.services
                    services = self._services.pop(run)
                    runner.take_up([each for each in services if each.service in open_])
                    for resource in self._close(run, "go_on", by):
                        if not is_behavior(self._availability.holder(resource)):
                            self._dispatcher.resume(resource, run)
                    return
                case RunEnded():
                    # Held resources stay held: no operator has said that they may move.
                    del self._services[run]
                    self._close(run, "stop", "")
                    return

    def _close(self, run: RunId, decision: str, by: str) -> tuple[ResourceId, ...]:
        held = self._held.pop(run)
        for resource in held:
            self._handover.restore(resource)
        self._runners[run].prompts.pop(PROMPT, None)
        self._events.publish(PromptClosed(run, PROMPT, decision, by))
        return held

    def _allocated(self, runner: Runner) -> Sequence[ResourceId]:
        """Every vehicle and payload of the mission, but what another run commands now."""
        all_of_them = resources_of_mission(runner.run.state.mission, self._arbiters.fleet)
        holder = self._availability.holder
        return [
            each
            for each in all_of_them
            if (holder(each) or runner.id).partition(".")[0] == runner.id
        ]

    async def _cancel_unknown(self, runner: Runner, loss: Loss) -> list[str]:
        """Cancel behaviors of the run that its arbiters execute and its journal does not know."""
        known: set[str] = set()
        async for entry in self._journal.read(runner.id):
            known.update(each.behavior for each in entry.records if type(each) is BehaviorRequested)
        ids = (
            f"{runner.id}.b{number}"
            for number in range(1, runner.run.state.last_behavior + loss.records + 1)
        )
        candidates = [each for each in ids if each not in known][:PROBED]
        asked = [
            self._cancel_if_under_way(arbiter, behavior, runner.epoch)
            for behavior in candidates
            for arbiter in self._arbiters.by_name.values()
        ]
        return [found for found in await asyncio.gather(*asked) if found]

    async def _cancel_if_under_way(self, arbiter: Arbiter, behavior: str, epoch: int) -> str:
        try:
            async with asyncio.timeout(CALL_TIMEOUT_S):
                report = await arbiter.query(behavior, None)
                if report.state not in _UNDER_WAY:
                    return ""
                await arbiter.cancel(behavior, epoch)
        except TimeoutError:
            log.error("%s: its arbiter did not answer within %s s", behavior, CALL_TIMEOUT_S)
            return ""
        except Exception:  # an arbiter's fault must not keep the operators from being asked
            log.exception("%s: its arbiter raised", behavior)
            return ""
        return behavior


def unknown_decision(decision: str) -> OperatorError:
    """The error for an answer that the prompt does not offer."""
    known = ", ".join(each.value for each in DECISIONS)
    return OperatorError(f"{decision!r} is no decision of prompt {PROMPT}: {known}")


def _text(run: RunId, loss: Loss, held: Sequence[str], unknown: Sequence[str]) -> str:
    cancelled = (
        f" {', '.join(unknown)} was under way and not in the journal: it is cancelled."
        if unknown
        else ""
    )
    return (
        f"{run}: {loss}. Its vehicles may have done what the mission does not know.{cancelled} "
        f"Held: {', '.join(held) or 'nothing'}. Look where they are. Go on from the last record "
        "there is (each task under way is asked about), or stop the mission?"
    )
