"""Taking a run over after a restart (docs/architecture.md, "Journal and resume").

Claim the run, fold its records, then look before doing anything: every behavior that should be
running is asked for at its arbiter. Nothing is sent again that may have been done already.
"""

import asyncio
import logging
import math
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress

from m2pem.api.arbiter import Arbiter, BehaviorReport
from m2pem.engine import commands as c
from m2pem.engine.inputs import (
    BehaviorMissing,
    ClaimRun,
    ControlRequestEnded,
    ControlTaken,
    GeometrySet,
    Input,
    PauseRun,
    RequestOutcome,
    ResourceFault,
)
from m2pem.engine.run import MissionRun
from m2pem.engine.state import Behavior, BehaviorPhase, RunStatus
from m2pem.errors import StaleEpochError
from m2pem.executive.behavior_lifecycle import DispatcherView
from m2pem.executive.behavior_reports import reported, spec_of
from m2pem.executive.dispatcher import Dispatcher
from m2pem.executive.fleet_connections import FleetArbiters
from m2pem.executive.journal_loss import doubted, paused_by
from m2pem.executive.runner import OnRecords, Runner
from m2pem.fleet.parameters import ParameterError
from m2pem.journal.base import Journal, Loss
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import BehaviorState, ResourceId, ResumePolicy
from m2pem.monitors.run_monitors import RunMonitors

log = logging.getLogger("m2pem.resume")

QUERY_TIMEOUT_S = 10.0
"""How long an arbiter may take to look at a vehicle before it counts as unreachable."""

STOPPED_WITHIN_S = 1.0
"""The same once an operator has stopped the run: the cancels of its other vehicles wait for it."""

UNASKED = "its arbiter could not be asked after a restart"
"""Why a resource counts as lost after a restart."""


async def replay(
    journal: Journal,
    run: MissionRun,
    on_records: OnRecords | None,
    monitors: RunMonitors | None = None,
) -> int:
    """Fold all of a run's records; returns when the last was decided (us since the Unix epoch).

    `monitors` read them, and `on_records` is called with the records of each entry.
    """
    last_us = 0
    async for entry in journal.read(run.state.run):
        run.replay(entry.records, entry.input)
        if monitors is not None:
            monitors.observe(entry.t_us, entry.records)
        if on_records is not None:
            on_records(run.state.run, entry.records)
        last_us = max(last_us, entry.at_us)
    return last_us


def claim(
    runner: Runner, loss: Loss | None, taken: Mapping[ResourceId, str], given: Iterable[GeometrySet]
) -> None:
    """Post the first inputs of a replayed run under its new epoch.

    `taken`, `given`: what operators have taken and handed over, of which it may not know.
    """
    runner.post(ClaimRun(runner.epoch, lost=loss.records if loss is not None else 0))
    if loss is not None:
        runner.post(PauseRun(paused_by(loss)))
    for resource, operator in taken.items():
        known = runner.run.state.taken.get(resource)
        if known is None:
            runner.post(ControlTaken(resource, operator))
        elif known != operator:  # by another run: this one did not get its end
            runner.post(ControlRequestEnded(resource, operator, RequestOutcome.GIVEN))
    for geometry in given:
        runner.post(geometry)


async def take_over(
    runner: Runner,
    arbiters: FleetArbiters,
    dispatcher: Dispatcher,
    outage_s: float,
    lost: Callable[[ResourceId, str], None],
    loss: Loss | None = None,
    stopped: asyncio.Event | None = None,
) -> list[c.Command]:
    """Give a replayed and claimed run what it commanded. Its task must not run yet.

    Returns the commands that are still to be carried out: when every interrupted run has what it
    commanded, as they may be for a vehicle that another one has.

    `outage_s`: for how long no executive drove it; infinite: that is not known. Longer than the
    fleet's `max_outage`, every behavior is held and an operator is asked. `lost`: is called for
    each resource whose arbiter cannot be asked, which must stop before it is free again. `loss`:
    what the journal has lost of it: the run is paused, and an operator is asked about every
    behavior when it goes on (see `JournalLossPrompts`). `stopped`: is set when an operator stops
    the run meanwhile, whose cancels wait for this.
    """
    state = runner.run.state
    max_outage_s = arbiters.fleet.max_outage_s
    too_long = max_outage_s is not None and outage_s > max_outage_s
    # The run's inputs are decided after this; a paused one defers what is restarted.
    paused = state.status is RunStatus.PAUSED
    known = list(state.behaviors.values())
    for incident in state.incidents.values():
        dispatcher.keep(incident.id, incident.resources)
    for keeping in state.kept.values():
        dispatcher.keep_between_tasks(keeping.id, keeping.resource)
    _recall(runner, arbiters, dispatcher)
    reports = await asyncio.gather(*(_query(arbiters, each, stopped) for each in known))
    if (newest := _newest_epoch(reports)) > runner.epoch:
        runner.fail(replaced_by(runner, newest))
        return []
    resend: set[str] = set()
    for behavior, report in zip(known, reports, strict=True):
        number = max(report.number if report is not None else 0, behavior.number)
        not_begun = report is not None and _is_not_begun(behavior, report)
        not_begun = not_begun and not too_long and loss is None
        if not_begun and behavior.state is None and not paused:
            resend.add(behavior.id)
            continue
        arbiter = _arbiter(arbiters, behavior)
        dispatcher.adopt(behavior.id, behavior.resources, number, arbiter)
        with suppress(ParameterError):
            dispatcher.occupy(_as_commanded(runner, behavior))
        policy = ResumePolicy.RESTART if not_begun else _policy(arbiters, behavior, too_long)
        item = _what_to_post(arbiters, behavior, report, policy)
        if item is None and behavior.phase is BehaviorPhase.ACTIVE:
            reason = _why_ask(state.status, report, outage_s if too_long else None)
            if reason:
                running = BehaviorState.RUNNING
                item = BehaviorMissing(behavior.id, ResumePolicy.HOLD, running, reason)
        if loss is not None:
            item = doubted(behavior, report, item, loss)
        if report is None:
            # After `occupy`: who returns is commanded to end what holds it.
            for name in behavior.resources:
                lost(ResourceId(name), UNASKED)
        if item is not None:
            runner.post(item)

    def is_due(command: c.Command) -> bool:
        match command:
            case c.StartBehavior():
                return command.behavior in resend
            case c.RunService():  # it may command what an operator must be asked about first
                return loss is None
            case _:
                return True

    return [command for command in runner.run.outstanding() if is_due(command)]


async def look_again(
    runner: Runner, arbiters: FleetArbiters, dispatcher: Dispatcher, outage_s: float
) -> tuple[list[Input], frozenset[str]]:
    """Look at the vehicles of a run after an outage of this executive, before it sends anything.

    Returns the inputs that what was seen amounts to, and the behaviors whose start must not be
    sent any more. After an outage longer than the fleet's `max_outage`, every behavior is held and
    an operator is asked. A vehicle that cannot be asked is left to the link monitor.

    Raises:
        StaleEpochError: a vehicle has seen a newer epoch of the run.
    """
    state = runner.run.state
    max_outage_s = arbiters.fleet.max_outage_s
    too_long = max_outage_s is not None and outage_s > max_outage_s
    known = list(state.behaviors.values())
    reports = await asyncio.gather(*(_query(arbiters, behavior) for behavior in known))
    if (newest := _newest_epoch(reports)) > runner.epoch:
        raise replaced_by(runner, newest)
    items: list[Input] = []
    unsent: set[str] = set()
    for behavior, report in zip(known, reports, strict=True):
        active = behavior.phase is BehaviorPhase.ACTIVE
        begun = behavior.state is not None
        item: Input | None = None
        if report is not None and begun:
            policy = _policy(arbiters, behavior, too_long)
            item = _what_to_post(arbiters, behavior, report, policy)
        if item is None and active and too_long:
            if dispatcher.view(behavior.id) is DispatcherView.NONE:
                if state.status is RunStatus.PAUSED:
                    continue  # it was not sent, and is not before an operator lets the run go on
                unsent.add(behavior.id)
                arbiter = _arbiter(arbiters, behavior)
                dispatcher.adopt(behavior.id, behavior.resources, behavior.number, arbiter)
            seen = report.state if report is not None else BehaviorState.UNKNOWN
            reason = f"the executive did nothing for {outage_s:.0f} s"
            item = BehaviorMissing(behavior.id, ResumePolicy.HOLD, seen, reason)
        if item is not None:
            items.append(item)
    return items, frozenset(unsent)


def _recall(runner: Runner, arbiters: FleetArbiters, dispatcher: Dispatcher) -> None:
    """Give the arbiter of teams its requests: the arbiters of vehicles do not know them."""
    for behavior in runner.run.state.behaviors.values():
        if _arbiter(arbiters, behavior) is not arbiters.teams:
            continue
        ids = tuple(ResourceId(name) for name in behavior.resources)
        spec = dispatcher.spec(ids, behavior.name, BehaviorType(behavior.type))
        try:
            if spec is not None:
                request = dispatcher.request(_as_commanded(runner, behavior), spec)
                arbiters.teams.recall(request)
        except ParameterError as error:
            log.warning("%s: it cannot be taken up again: %s", behavior.id, error)


def _as_commanded(runner: Runner, behavior: Behavior) -> c.StartBehavior:
    return c.StartBehavior(
        behavior.id,
        behavior.element,
        runner.epoch,
        behavior.type,
        behavior.name,
        behavior.resources,
        behavior.roles,
        behavior.parameters,
    )


def _arbiter(arbiters: FleetArbiters, behavior: Behavior) -> Arbiter:
    ids = [ResourceId(name) for name in behavior.resources]
    serving = arbiters.serving(ids, behavior.name, BehaviorType(behavior.type))
    return serving or arbiters.of(ids[0])


def _newest_epoch(reports: Iterable[BehaviorReport | None]) -> int:
    """Return the highest epoch that a vehicle has seen; 0: none says."""
    return max((report.epoch for report in reports if report is not None), default=0)


def replaced_by(runner: Runner, newest: int) -> StaleEpochError:
    """The error for a run of which a vehicle has seen a newer epoch."""
    return StaleEpochError(
        f"a vehicle has seen epoch {newest} of {runner.id}, and this executive has epoch "
        f"{runner.epoch}: another one drives it"
    )


async def _query(
    arbiters: FleetArbiters, behavior: Behavior, stopped: asyncio.Event | None = None
) -> BehaviorReport | None:
    """What the arbiter sees; None: it cannot say."""
    arbiter = _arbiter(arbiters, behavior)
    try:
        async with asyncio.timeout(QUERY_TIMEOUT_S) as limit:
            hurry = None if stopped is None else asyncio.create_task(_hurry(limit, stopped))
            try:
                return await arbiter.query(behavior.id, behavior.native_ref)
            finally:
                if hurry is not None:
                    hurry.cancel()
    except TimeoutError:
        is_stopped = stopped is not None and stopped.is_set()
        within_s = STOPPED_WITHIN_S if is_stopped else QUERY_TIMEOUT_S
        log.error("%s: its arbiter did not answer within %s s", behavior.id, within_s)
    except Exception:  # an arbiter's fault is an unreachable vehicle
        log.exception("%s: its arbiter raised on query", behavior.id)
    return None


async def _hurry(limit: asyncio.Timeout, stopped: asyncio.Event) -> None:
    """Let a query end soon once its run is stopped."""
    await stopped.wait()
    now_s = asyncio.get_running_loop().time()
    limit.reschedule(min(limit.when() or now_s, now_s + STOPPED_WITHIN_S))


def _is_not_begun(behavior: Behavior, report: BehaviorReport) -> bool:
    """Whether starting it now is what the mission wants: the journal has no sign that it began, and
    its arbiter neither."""
    if behavior.phase is not BehaviorPhase.ACTIVE or report.state is not BehaviorState.UNKNOWN:
        return False
    if behavior.state is None:
        return report.number == 0
    return behavior.state is BehaviorState.ACCEPTED and report.not_begun


def _what_to_post(
    arbiters: FleetArbiters,
    behavior: Behavior,
    report: BehaviorReport | None,
    policy: ResumePolicy,
) -> Input | None:
    """The input that what was seen amounts to; None: it is as the journal says. `policy`: for what
    the arbiter does not know."""
    if report is None:
        return ResourceFault(behavior.resources[0], "LINK_LOST", UNASKED, reachable=False)
    if report.state in (BehaviorState.ACCEPTED, BehaviorState.RUNNING):
        return None
    if report.state is BehaviorState.UNKNOWN:
        reason = report.reason or "its arbiter no longer knows it"
        return BehaviorMissing(behavior.id, policy, report.state, reason)
    return reported(report, behavior, arbiters, behavior.number + 1)


def _why_ask(status: RunStatus, report: BehaviorReport | None, outage_s: float | None) -> str:
    """Why an operator must say whether a behavior that goes on may; "" if it may.

    `outage_s`: how long the run had no executive, if that was too long. A hold that the journal
    does not know of came from an executive whose journal failed, or from an operator whose pause
    was not written any more: only an operator can say whether it is over.
    """
    if outage_s == math.inf:
        return "for how long no executive drove the mission is not known: the clock went back"
    if outage_s is not None:
        return f"no executive drove the mission for {outage_s:.0f} s"
    if report is not None and report.held and status is not RunStatus.PAUSED:
        return "held, and the journal does not say why: its executive failed, or paused the run"
    return ""


def _policy(arbiters: FleetArbiters, behavior: Behavior, too_long: bool) -> ResumePolicy:
    spec = spec_of(behavior, arbiters)
    return ResumePolicy.HOLD if spec is None or too_long else spec.resume
