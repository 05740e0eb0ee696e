"""The arbiter of teams: composes a team behavior of behaviors of members of any arbiter."""

import logging
from collections.abc import AsyncIterator, Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

from m2pem.api.arbiter import (
    Arbiter,
    ArbiterContext,
    BehaviorId,
    BehaviorReport,
    BehaviorRequest,
    Limits,
)
from m2pem.api.async_queue import AsyncQueue
from m2pem.api.behavior_tracker import BehaviorTracker
from m2pem.api.capabilities import ArbiterCapabilities
from m2pem.api.telemetry import TeamMemberState, TeamState
from m2pem.fleet.allocation import spelled_out
from m2pem.fleet.fleet import Fleet, LostMemberPolicy
from m2pem.mission.catalogue import BehaviorSpec, BehaviorState, ResourceId
from m2pem.teams.behavior import TeamBehavior
from m2pem.teams.capabilities import Capabilities
from m2pem.teams.member import Member
from m2pem.teams.plan import TeamRefusedError
from m2pem.teams.restart import FoundParts, Reference, look_for_parts, read_reference
from m2pem.teams.team_state import TeamPlan, TeamSituation

REMEMBERED = 1_000
STATES_WAITING = 1_000
CANCEL_MARGIN_S = 1.0
"""Time for a team to name the member that did not end, before the team's own timeout."""

_log = logging.getLogger("m2pem.teams")


@dataclass(frozen=True, slots=True)
class _Remains:
    """A team behavior after a restart of which some parts are not known."""

    request: BehaviorRequest
    scheme: TeamPlan
    found: FoundParts
    kept: Reference


class Teams:
    """Implements `m2pem.api.Arbiter` for team behaviors of any members.

    `arbiter_of`: the arbiter of a vehicle. A part's id has the behavior and the member:
    "r1.b3.evsg1" is the part of evsg1 in r1.b3. The reader of the arbiters' reports passes those of
    parts to `report_received`, and faults of members to `fault`.
    """

    capabilities = ArbiterCapabilities(fences=True)

    def __init__(
        self,
        fleet: Fleet,
        arbiter_of: Callable[[ResourceId], Arbiter],
        context: ArbiterContext,
        capabilities: Capabilities,
    ) -> None:
        self._fleet = fleet
        self._arbiter_of = arbiter_of
        self._context = context
        self._capabilities = capabilities
        self._situation = TeamSituation(fleet, capabilities, context.bus, arbiter_of)
        self._ledger = BehaviorTracker(self.catalogue, _log)
        self._behaviors: dict[BehaviorId, TeamBehavior] = {}
        self._requests: dict[BehaviorId, BehaviorRequest] = {}
        self._remains: dict[BehaviorId, _Remains] = {}
        self._states: AsyncQueue[TeamState] = AsyncQueue(STATES_WAITING)

    # --- capabilities ---------------------------------------------------------------------------

    def catalogue(self, resource: ResourceId) -> Sequence[BehaviorSpec]:
        """Return a vehicle's own behaviors, and the team behaviors in which it can take part."""
        alone = self._capabilities.alone(resource)
        together = self._capabilities.together(resource)
        names = {spec.name for spec in together}
        return (*together, *(spec for spec in alone.values() if spec.name not in names))

    def limits(self, resource: ResourceId) -> Limits:
        """Return a member's own limits, with some time for the team's report."""
        own = self._arbiter_of(resource).limits(resource)
        return replace(own, cancel_timeout_s=own.cancel_timeout_s + CANCEL_MARGIN_S)

    def marshals(self, resource: ResourceId) -> bool:
        """Whether a vehicle is a member of a running team behavior: holds must come here."""
        return self._behavior_of(resource) is not None

    def parts_of(
        self, behaviors: Sequence[BehaviorId], resources: Sequence[ResourceId]
    ) -> tuple[BehaviorId, ...]:
        """Return the behaviors to preempt, with the parts of theirs that resources carry out."""
        teams = (self._behaviors[name] for name in behaviors if name in self._behaviors)
        members = (each for team in teams for each in team.members.values())
        parts = [each.part for each in members if each.id in resources and each.active]
        return (*behaviors, *parts)

    # --- the protocol ---------------------------------------------------------------------------

    async def connect(self) -> None:
        """Do nothing: the members have arbiters of their own."""

    async def start(self, request: BehaviorRequest) -> None:
        await self._situation.until_seen(request, self._context.clock)
        made: list[TeamPlan] = []

        def refusal(checked: BehaviorRequest) -> str:
            try:
                begun = request.id in self._remains
                made.append(self._situation.scheme(checked, begun=begun))
            except TeamRefusedError as error:
                return str(error)
            return ""

        if not self._ledger.admit(request, refusal=refusal):
            return
        parts = self.parts_of(request.preempts, request.resources)
        for name in request.preempts:
            if name in self._behaviors:
                self._behaviors[name].leave(request.resources)
        behavior = self._make(replace(request, preempts=parts), made[0])
        remains = self._remains.pop(request.id, None)
        if remains is not None:
            behavior.take_up(remains.found.good, remains.kept)
        behavior.start()

    async def cancel(self, behavior: BehaviorId, epoch: int) -> None:
        remains = self._remains.pop(behavior, None)
        if remains is not None:
            self._ledger.adopt(behavior, remains.request.resources, remains.kept.text())
            left = self._make(remains.request, remains.scheme)
            left.found(remains.found.good, remains.kept)
        if self._ledger.may_cancel(behavior, epoch) and behavior in self._behaviors:
            self._behaviors[behavior].cancel(epoch)

    async def query(self, behavior: BehaviorId, native_ref: str | None) -> BehaviorReport:
        """Report the state of a team behavior; after a restart, query the arbiters of its parts.

        The behavior goes on if all parts are known; parts that have failed meanwhile fail now.
        Else it is UNKNOWN; its running parts are kept for a `start` with the same id, which adopts
        them, or a `cancel`.
        """
        self._ledger.fence(behavior, self._context.epoch_of(behavior))
        request = self._requests.pop(behavior, None)
        known = self._ledger.last(behavior)
        if known.state is not BehaviorState.UNKNOWN or request is None:
            return known
        await self._situation.until_seen(request, self._context.clock)
        kept = read_reference(native_ref)
        try:
            scheme = self._situation.scheme(request, begun=True, split=kept.split, lost=kept.lost)
        except TeamRefusedError as error:
            return replace(known, reason=f"it cannot be gone on with: {error}")
        found = await look_for_parts(request, scheme.plan, kept, self._arbiter_of)
        if found.gap:
            self._remains[behavior] = _Remains(request, scheme, found, found.trimmed(kept))
            return replace(known, reason=found.gap)
        self._ledger.adopt(behavior, request.resources, native_ref, 1 + max(1, kept.version))
        adopted = self._make(request, scheme)
        held = found.held(marches=scheme.plan.march is not None)
        adopted.found(found.reports, kept, halts=not held)
        adopted.start()
        return replace(self._ledger.last(behavior), held=held)

    async def fence(self, run: str, epoch: int) -> None:
        """Refuse lower epochs of a run; the arbiters of the members have a fence of their own."""
        self._ledger.fence(run, epoch)

    async def disown(self, run: str) -> None:
        """End the formation controllers of a run. Vehicles go on with their parts."""
        for name in self._ledger.disown(run):
            if (behavior := self._behaviors.pop(name, None)) is not None:
                behavior.close()

    async def hold(self, resource: ResourceId) -> None:
        """Hold a member for a run: the whole team waits."""
        await (self._behavior_of(resource) or self._arbiter_of(resource)).hold(resource)

    async def resume(self, resource: ResourceId) -> None:
        """Resume a member for a run; the team goes on when no member is held."""
        await (self._behavior_of(resource) or self._arbiter_of(resource)).resume(resource)

    def reports(self) -> AsyncIterator[BehaviorReport]:
        return self._ledger.reports()

    def telemetry(self) -> AsyncIterator[TeamState]:
        return self._states.read()

    async def close(self) -> None:
        """End all formation controllers. Vehicles go on with their parts."""
        for behavior in self._behaviors.values():
            behavior.close()
        self._states.close()
        self._ledger.close()

    # --- calls of the executive -----------------------------------------------------------------

    def report_received(self, report: BehaviorReport) -> bool:
        """Process a report if it is of a part; return False if it is of another behavior."""
        name, _, part = report.id.partition(".")
        name, part = f"{name}.{part.partition('.')[0]}", part.partition(".")[2]
        if not part:
            return False
        behavior = self._behaviors.get(name)
        if behavior is None:
            _log.info("a report for %s, of a team behavior that is not known here", report.id)
        else:
            behavior.report_received(report)
        return True

    def fault(self, resource: ResourceId, code: str, reason: str) -> bool:
        """Process a fault of a member; return False if it is in no running team behavior."""
        behavior = self._behavior_of(resource)
        if behavior is None:
            return False
        behavior.lose(resource, code, reason)
        return True

    def recall(self, request: BehaviorRequest) -> None:
        """Remember the request of a behavior that `query` will be called for after a restart."""
        self._requests[request.id] = request

    @property
    def expects(self) -> bool:
        """Whether a team may still change by the passing of time; for rehearsals."""
        return any(behavior.expects for behavior in self._behaviors.values())

    # --- inside ---------------------------------------------------------------------------------

    def _behavior_of(self, resource: ResourceId) -> TeamBehavior | None:
        for behavior in reversed(self._behaviors.values()):
            if not behavior.over and resource in behavior.members:
                return behavior
        return None

    def _make(self, request: BehaviorRequest, scheme: TeamPlan) -> TeamBehavior:
        def failed(member: ResourceId, reason: str) -> None:
            behavior.failed_to_start(member, reason)

        def report_state(state: BehaviorState, code: str, reason: str) -> None:
            if state.terminal:
                self._ledger.end(request.id, state, code, reason)
            else:
                self._ledger.progress(request.id)

        def show(kept: tuple[TeamMemberState, ...], spacing_m: float) -> None:
            now_us = self._context.clock.now_us()
            state = TeamState(request.id, request.behavior, now_us, kept, spacing_m)
            self._states.put(state)

        superseded = partial(self._ledger.superseded, request.id)
        may_send = self._context.may_send
        members = {
            each: Member(each, self._arbiter_of(each), failed, superseded, may_send)
            for each in request.resources
        }
        behavior = TeamBehavior(
            request,
            scheme.plan,
            members,
            scheme.frame,
            self._context.clock,
            lambda member: self._situation.present(member, scheme.frame),
            report_state,
            lambda reference: self._ledger.refer(request.id, reference.text()),
            show,
            goes_on=self._goes_on(request),
        )
        self._behaviors.pop(request.id, None)
        self._behaviors[request.id] = behavior
        self._forget()
        return behavior

    def _goes_on(self, request: BehaviorRequest) -> bool:
        """Whether all teams of a request go on without a lost member."""
        teams = [members for members in request.roles.values() if members] or [request.resources]
        policies: dict[tuple[ResourceId, ...], set[LostMemberPolicy]] = {}
        for team in self._fleet.teams.values():
            policies.setdefault(spelled_out(team), set()).add(team.on_lost_member)
        return all(policies.get(tuple(team)) == {LostMemberPolicy.CONTINUE} for team in teams)

    def _forget(self) -> None:
        """Forget the oldest behavior that has ended."""
        if len(self._behaviors) > REMEMBERED:
            over = (name for name, each in self._behaviors.items() if each.over)
            if (oldest := next(over, None)) is not None:
                del self._behaviors[oldest]
