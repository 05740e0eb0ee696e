"""One running team behavior: its parts begin, keep formation, end, and are lost."""

import asyncio
import logging
from collections.abc import Callable, Mapping
from dataclasses import replace

from m2pem.api.arbiter import BehaviorId, BehaviorReport, BehaviorRequest
from m2pem.api.clock import Clock
from m2pem.api.telemetry import TeamMemberState
from m2pem.geo.local_frame import EastNorth, LocalFrame
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.teams.formation_controller import PERIOD_S, FormationController
from m2pem.teams.member import Member
from m2pem.teams.partition import Partition
from m2pem.teams.plan import MemberPose, Plan
from m2pem.teams.restart import Reference
from m2pem.units import US_PER_S

IDLE_PERIOD_S = 1.0
STIRS_WITHIN_S = 120.0
"""A rehearsed march of which no member has moved for this time cannot go on by itself."""

STIR_M = 0.01
ACCEPT_WITHIN_S = 15.0
"""A member that has reported nothing about its part by then has failed to start it."""

_log = logging.getLogger("m2pem.teams")

ReportState = Callable[[BehaviorState, str, str], None]
"""(state, code, reason): RUNNING, or a terminal state."""


class TeamBehavior:
    """Carries out a plan by the members.

    `look` returns a member's present pose; None: it is not known. `report_state` is called with
    RUNNING and with the end; `refer`, before each RUNNING, with the reference that the journal
    keeps. `show` gets the members' deviations from their places in a march, and the spacing in
    metres. `goes_on`: the behavior continues without a lost member.

    All methods but `hold` and `resume` are synchronous, so that reports are processed in their
    order; calls to arbiters wait in the members.
    """

    def __init__(
        self,
        request: BehaviorRequest,
        plan: Plan,
        members: Mapping[ResourceId, Member],
        frame: LocalFrame,
        clock: Clock,
        look: Callable[[ResourceId], MemberPose | None],
        report_state: ReportState,
        refer: Callable[[Reference], None],
        show: Callable[[tuple[TeamMemberState, ...], float], None],
        *,
        goes_on: bool,
    ) -> None:
        self.id: BehaviorId = request.id
        self.epoch = request.epoch
        self.members = dict(members)
        self._request = request
        self._plan = plan
        self._clock = clock
        self._look = look
        self._report_state = report_state
        self._refer = refer
        self._show = show
        self._goes_on = goes_on
        self._shares = Partition(plan, frame)
        steady = [each.id for each in members.values() if not each.adjustable]
        self._controller = FormationController(plan.march, steady) if plan.march else None
        self._reference = Reference()
        self._running_reported = False
        self._ended_meanwhile: list[BehaviorReport] = []
        self._ending: tuple[BehaviorState, str, str] | None = None
        self._ending_due_us = 0
        self._led_around: dict[ResourceId, str] = {}
        self._withdrawn: set[str] = set()
        self._stayed_s = 0.0
        self._stirred_us = clock.now_us()
        self._over = False
        self._wake = asyncio.Event()
        self._ticking: asyncio.Task[None] | None = None

    # --- commands of the run ---------------------------------------------------------------------

    def start(self) -> None:
        """Begin, or go on after a restart."""
        if self._plan.march is not None and self._plan.march.in_order:
            _log.warning("%s: members go around others that wait to set off", self.id)
        self._ticking = asyncio.get_running_loop().create_task(self._tick())
        for report in self._ended_meanwhile:
            self.report_received(report)
        self._review()

    def cancel(self, epoch: int) -> None:
        """End all parts; CANCELLED when the last of them has ended."""
        self.epoch = max(epoch, self.epoch)
        self._end_all(BehaviorState.CANCELLED, "", "")

    def leave(self, keep: tuple[ResourceId, ...]) -> None:
        """Another behavior has taken the team over, and `keep` of its members: stop the others."""
        self._over = True
        self._wake.set()
        for member in self.members.values():
            if member.id not in keep:
                member.cancel(self.epoch)

    def close(self) -> None:
        """Command nothing more; the vehicles go on with their parts."""
        self._over = True
        if self._ticking is not None:
            self._ticking.cancel()
        for member in self.members.values():
            member.close()

    @property
    def over(self) -> bool:
        """Whether it has reported its end, or another behavior has taken its team over."""
        return self._over

    async def hold(self, member: ResourceId) -> None:
        """Hold a member for a run; the team fails if the member cannot be held."""
        wrong = await self.members[member].hold()
        if wrong:
            self._disobeyed(member, f"it was not held: {wrong}")

    async def resume(self, member: ResourceId) -> None:
        """Resume a member for a run; the team fails if the member does not resume."""
        wrong = await self.members[member].resume()
        if wrong:
            self._disobeyed(member, f"it was not let go on: {wrong}")
        self._review()

    @property
    def paused(self) -> bool:
        """Whether a run holds a member: then no member is resumed, slowed or started."""
        return any(member.paused for member in self.members.values() if not member.lost)

    @property
    def expects(self) -> bool:
        """Whether the behavior may still change by the passing of time alone."""
        if self._over or self._period_s() is None:
            return False
        if self._ending is not None or self._controller is None:
            return True
        return self._clock.now_us() - self._stirred_us < STIRS_WITHIN_S * US_PER_S

    # --- events of members ----------------------------------------------------------------------

    def report_received(self, report: BehaviorReport) -> None:
        """Process a report of a member's arbiter about its part."""
        member = next((each for each in self.members.values() if each.part == report.id), None)
        if member is None or not member.active:
            return
        member.state = report.state
        member.native_ref = report.native_ref or member.native_ref
        part = member.part.removeprefix(f"{self.id}.")
        left = report.remaining
        unnoted = left is not None and self._goes_on and self._shares.note_left(part, left)
        if report.state.terminal:
            self._part_ended(member, report)
        elif unnoted:
            self._note()
        self._review()

    def lose(self, member: ResourceId, code: str, reason: str) -> None:
        """Process the loss of a member's link, or another fault of it."""
        lost = self.members[member]
        if not lost.lost and not self._over:
            lost.cancel(self.epoch)
            if code == "LINK_LOST":
                lost.state = BehaviorState.LOST  # its end may never be reported: do not wait for it
            self._miss(lost, code, reason)
            self._review()

    def failed_to_start(self, member: ResourceId, reason: str) -> None:
        """Fail the team, because a member's arbiter did not accept its part."""
        failed = self.members[member]
        if failed.active:
            failed.state = BehaviorState.REJECTED
            self._end_all(BehaviorState.FAILED, "REJECTED", f"{member}: {reason}")
            self._review()

    def _disobeyed(self, member: ResourceId, reason: str) -> None:
        if self.members[member].active:
            self._end_all(BehaviorState.FAILED, "FAILED", f"{member}: {reason}")

    def found(
        self, reports: Mapping[str, BehaviorReport], kept: Reference, *, halts: bool = False
    ) -> None:
        """Adopt the parts that the arbiters know; after a restart, before `start`.

        `halts`: the formation controller has halted the held members, and resumes them.
        """
        self._running_reported = True
        self._reference = kept
        self._shares.restore(kept)
        for name, why in kept.lost.items():
            if name in self.members:
                self.members[name].lost = why
        for part, report in reports.items():
            done = report.state is BehaviorState.SUCCEEDED
            member = self.members.get(self._shares.place(part, done=done))
            if member is not None and not member.active:
                as_before = report
                if report.state.terminal and not done:
                    self._ended_meanwhile.append(report)
                    as_before = replace(report, state=BehaviorState.RUNNING)
                member.adopt(f"{self.id}.{part}", as_before, kept.begun.get(part))
                member.halted = halts and report.held
                if report.remaining is not None:
                    self._shares.note_left(part, report.remaining)
        for name in kept.lost:
            if name in self.members:
                self._drop(self.members[name])

    def take_up(self, reports: Mapping[str, BehaviorReport], kept: Reference) -> None:
        """As `found`, but some parts are missing: they start again, and the others resume."""
        self.found(reports, kept)
        self._running_reported = False
        self._shares.again = True
        self._shares.begin_with_what_is_left()
        for member in self.members.values():
            member.let_go()

    def _part_ended(self, member: Member, report: BehaviorReport) -> None:
        if report.state is BehaviorState.SUCCEEDED:
            self._shares.finish(member.part.removeprefix(f"{self.id}."))
            return
        if self._ending is not None or member.lost:
            return
        if not self._shares.carries(member.part.removeprefix(f"{self.id}.")):
            return  # it begins again
        code = report.code or ("LINK_LOST" if report.state is BehaviorState.LOST else "FAILED")
        reason = report.reason or f"its part ended {report.state.value}"
        if report.state is BehaviorState.REJECTED or code == "TAKEN_OVER":
            self._end_all(BehaviorState.FAILED, code, f"{member.id}: {reason}")
        else:
            self._miss(member, code, reason)

    def _miss(self, member: Member, code: str, reason: str) -> None:
        """By the team's policy: end, or go on without the member."""
        member.lost = f"{code}: {reason}"
        if self._ending is not None:
            return
        left = [each for each in self.members.values() if not each.lost]
        if not self._goes_on or not left:
            all_links_lost = code == "LINK_LOST" and not left
            state = BehaviorState.LOST if all_links_lost else BehaviorState.FAILED
            self._end_all(state, code, f"{member.id}: {reason}")
            return
        _log.warning("%s goes on without %s: %s", self.id, member.id, member.lost)
        self._drop(member)
        self._note()

    def _drop(self, member: Member) -> None:
        if self._controller is not None:
            for name in self._controller.drop(member.id):
                _log.warning("%s: %s goes around %s", self.id, name, member.id)
                self._led_around[name] = member.id
                self._withdrawn.add(self.members[name].part.removeprefix(f"{self.id}."))
                self._shares.withdraw(name)
                self.members[name].cancel(self.epoch)
        elif self._on_the_way(member):
            code, _, reason = member.lost.partition(": ")
            reason = f"{member.id}: {reason}; the others cannot pass it"
            self._end_all(BehaviorState.FAILED, code, reason)
        self._shares.drop(member.id, self.members, self._place)

    def _place(self, member: ResourceId) -> EastNorth | None:
        pose = self._look(member)
        return None if pose is None else pose.place

    # --- next steps -----------------------------------------------------------------------------

    def _review(self) -> None:
        if self._over:
            return
        self._wake.set()
        if self._ending is not None:
            if not any(member.active for member in self.members.values()):
                self._finish(*self._ending)
            return
        if not self.paused:
            self._send_off()
        active = [member for member in self.members.values() if member.active]
        if any(member.state is None for member in active):
            return
        if not self._running_reported:
            self._running_reported = True
            self._note()
        elif self._parts() != self._reference.begun:
            self._note()
        if not active and not self._plan.stays and self._shares.all_over:
            self._end_well()

    def _on_the_way(self, member: Member) -> bool:
        """Whether a member is on a way that others take after it."""
        follow = any(leg.after for leg in self._plan.legs)
        return follow and bool(member.part) and member.id not in self._shares.arrived

    def _lead_around(self, controller: FormationController) -> None:
        """Give new ways to members that have stopped, around those that were lost."""
        for name in list(self._led_around):
            member, pose = self.members[name], self._look(name)
            if member.active and not member.lost:
                continue
            lost = self._led_around.pop(name)
            if member.lost:
                continue
            places = [] if pose is None else controller.lead_around(name, pose)
            if places:
                self._shares.renew(name, places)
            stuck = controller.stuck() if places else name
            if stuck is not None and not (places and self._led_around):
                reason = f"{stuck} cannot go around {lost}, which is lost"
                self._end_all(BehaviorState.FAILED, "FAILED", reason)

    def _send_off(self) -> None:
        if self._controller is not None:
            self._lead_around(self._controller)
            if self._ending is not None:
                return
        for assignment in self._shares.assignments(self.members, self.epoch):
            part = f"{self.id}.{assignment.part}"
            preempts = self._request.preempts if assignment.own else ()
            assignment.member.begin(
                part, assignment.leg, self.epoch, preempts, self._clock.now_us()
            )

    def _parts(self) -> dict[str, str | None]:
        """The parts that have begun, with their references."""
        begun = dict(self._reference.begun)
        for member in self.members.values():
            if member.part and member.state is not None:
                begun[member.part.removeprefix(f"{self.id}.")] = member.native_ref
        return {part: ref for part, ref in begun.items() if part not in self._withdrawn}

    def _note(self) -> None:
        """Report RUNNING, with the reference that the journal keeps."""
        if not self._running_reported or self._ending is not None:
            return
        lost = {member.id: member.lost for member in self.members.values() if member.lost}
        self._reference = self._shares.noted(
            Reference(self._parts(), lost=lost, version=self._reference.version + 1)
        )
        self._refer(self._reference)
        self._report_state(BehaviorState.RUNNING, "", "")

    def _end_all(self, state: BehaviorState, code: str, reason: str) -> None:
        if self._over or self._ending is not None:
            return
        self._ending = (state, code, reason)
        bound_s = max(member.limits.cancel_timeout_s for member in self.members.values())
        self._ending_due_us = self._clock.now_us() + round(bound_s * US_PER_S)
        for member in self.members.values():
            member.cancel(self.epoch)
        self._review()

    def _end_well(self) -> None:
        lost = [f"{each.id} ({each.lost})" for each in self.members.values() if each.lost]
        reason = f"without {', '.join(lost)}" if lost else ""
        self._finish(BehaviorState.SUCCEEDED, "", reason)

    def _give_up(self, late: str) -> None:
        state, code, reason = self._ending or (BehaviorState.CANCELLED, "", "")
        if state is BehaviorState.CANCELLED:
            self._finish(BehaviorState.LOST, "TIMEOUT", late)
        else:
            self._finish(state, code, f"{reason}; {late}")

    def _finish(self, state: BehaviorState, code: str, reason: str) -> None:
        self._over = True
        self._wake.set()
        self._report_state(state, code, reason)

    # --- time -----------------------------------------------------------------------------------

    async def _tick(self) -> None:
        while not self._over:
            period_s = self._period_s()
            if period_s is None:
                self._wake.clear()
                await self._wake.wait()
                continue
            await self._clock.sleep(period_s)
            if not self._over:
                try:
                    self._pass(period_s)
                except Exception:  # the vehicles of a team must not go on unwatched
                    _log.exception("%s: held because of a bug in m2pem", self.id)
                    self._end_all(BehaviorState.FAILED, "FAILED", "a bug in m2pem: see its log")

    def _period_s(self) -> float | None:
        """Return the time until the next check; None: no member needs one."""
        if self._ending is not None:
            return PERIOD_S
        active = [member for member in self.members.values() if member.active]
        if self._controller is not None and any(each.goes or each.state is None for each in active):
            return PERIOD_S  # it may have to stop as soon as it goes
        if any(each.state is None for each in active):
            return IDLE_PERIOD_S
        if self._plan.duration_s is not None and self._shares.all_over:
            return min(IDLE_PERIOD_S, max(0.001, self._plan.duration_s - self._stayed_s))
        return None

    def _pass(self, seconds: float) -> None:
        now_us = self._clock.now_us()
        if self._ending is not None:
            if now_us >= self._ending_due_us:
                late = [member.id for member in self.members.values() if member.active]
                self._give_up(f"{', '.join(late)} did not end in time when cancelled")
            return
        for member in self.members.values():
            silent_us = now_us - member.begun_us
            if member.active and member.state is None and silent_us > ACCEPT_WITHIN_S * US_PER_S:
                reason = f"its arbiter said nothing for {ACCEPT_WITHIN_S:g} s"
                self.failed_to_start(member.id, reason)
                return
        if self.paused:
            return
        if self._controller is not None:
            self._march(self._controller)
        if self._plan.duration_s is not None and self._shares.all_over:
            self._stayed_s += seconds
            if self._stayed_s >= self._plan.duration_s:
                self._end_well()

    def _march(self, controller: FormationController) -> None:
        seen = {}
        for member in self.members.values():
            stand = self._look(member.id) if member.in_sight and not member.lost else None
            if stand is not None:
                seen[member.id] = stand
        before = controller.marks_m
        for name, speed_m_s in controller.step(seen, self._shares.arrived).items():
            self.members[name].go(speed_m_s, self.epoch)
        if any(
            abs(now - then) > STIR_M for now, then in zip(controller.marks_m, before, strict=True)
        ):
            self._stirred_us = self._clock.now_us()
        if any(member.publishes_position for member in self.members.values()):
            self._show(controller.kept(), controller.spacing_m)
