"""Revisions of running missions: the new version is read and checked, and its plan is made."""

import asyncio
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from m2pem.allocation.assignment import load_solver
from m2pem.api.authoring import MissionSource
from m2pem.api.revision import RevisionEffect, RevisionPreview, RevisionRefusal
from m2pem.api.runs import IncidentPreview, RunId
from m2pem.bpmn.one_task import is_one_task
from m2pem.engine.inputs import MonitoredRequirement, Revise
from m2pem.engine.revision import RevisionPlan, plan_revision
from m2pem.engine.revision.plan import called
from m2pem.engine.state import BehaviorPhase, RunState
from m2pem.errors import MissionError, OperatorError
from m2pem.executive.incidents import IncidentChoices
from m2pem.executive.loading import monitored_requirements
from m2pem.executive.revision_needs import NeedsOfRevisions
from m2pem.executive.run_starter import RunStarter
from m2pem.executive.runner import Runner
from m2pem.executive.supervisor import Supervisor
from m2pem.findings import Finding, has_errors
from m2pem.fleet.behaviors import ADJUSTABLE
from m2pem.fleet.space import waits_for_space
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.difference import Difference
from m2pem.mission.mission import Mission


@dataclass(frozen=True, slots=True)
class Prepared:
    """A new version that was read and checked, and its plan."""

    mission: Mission
    plan: RevisionPlan
    findings: tuple[Finding, ...]
    item: Revise


class RunRevisions:
    """Prepares revisions of the runs of an executive."""

    def __init__(
        self, supervisor: Supervisor, starter: RunStarter, outlooks: IncidentChoices
    ) -> None:
        self._supervisor = supervisor
        self._starter = starter
        self._outlooks = outlooks

    async def prepare(
        self, run: RunId, mission: MissionSource, moves: Mapping[str, str], by: str
    ) -> Prepared:
        """Read and check a new version, and make the plan of the revision to it.

        Raises:
            MissionError: it cannot be read.
            OperatorError: the run is not one that can be revised.
        """
        runner = self._runner(run)
        loaded = await self._starter.read(mission)
        state = runner.run.state
        root = state.root
        process = root.container.process.id if root is not None else None
        if process not in {each.id for each in loaded.processes}:
            process = None  # which the plan refuses
        names = tuple(root.data) if root is not None else ()
        found = await asyncio.to_thread(self._starter.findings, loaded, process, names)
        requirements = await asyncio.to_thread(self._requirements, state, loaded, names)
        if loaded.chooses_resources or waits_for_space(self._supervisor.fleet):
            await asyncio.to_thread(load_solver)
        # From here nothing is awaited: the plan is of this moment.
        now_us, adjustable = self._supervisor.clock.now_us(), self._adjustable(state)
        plan = plan_revision(state, loaded, moves, now_us, adjustable)
        files = (loaded.file, loaded.source, plan.digest, loaded.library)
        item = Revise(
            plan.version,
            *files,
            moves=dict(moves),
            by=by,
            requirements=requirements,
            adjustable=adjustable,
            conditions=self._supervisor.known_conditions(requirements),
        )
        return Prepared(loaded, plan, tuple(found), item)

    def _adjustable(self, state: RunState) -> tuple[str, ...]:
        """Return the behaviors whose speed can be changed while they go on."""
        return tuple(
            each.id
            for each in state.behaviors.values()
            if each.phase is BehaviorPhase.ACTIVE
            and each.type == BehaviorType.VEHICLE
            and each.name in ADJUSTABLE
            and self._supervisor.dispatcher.may_adjust(each.id)
        )

    def _requirements(
        self, state: RunState, new: Mission, names: Sequence[str]
    ) -> tuple[MonitoredRequirement, ...]:
        """Return what the run is monitored for with a new version: the requirements of that, and
        those that were given at its start beside those of its file."""
        # What reads formulas takes time to load, and most runs are never revised.
        from m2pem.verify.requirements.requirement import RequirementsError  # noqa: PLC0415

        fleet, plugins = self._supervisor.fleet, self._supervisor.plugins
        try:
            theirs = monitored_requirements(new, fleet, plugins, names)
        except RequirementsError:  # among the findings, too
            theirs = ()
        try:
            before = monitored_requirements(state.mission, fleet, plugins, names)
        except RequirementsError:
            before = ()
        of_files = {each.id for each in (*before, *theirs)}
        given = (each for each in state.requirements.values() if each.requirement not in of_files)
        return (
            *theirs,
            *(
                MonitoredRequirement(
                    each.requirement,
                    each.formula,
                    each.english,
                    each.elements,
                    each.on_violation,
                    each.conditions,
                )
                for each in given
            ),
        )

    def _runner(self, run: RunId) -> Runner:
        runner = self._supervisor.runner(run)
        if is_one_task(runner.run.state.mission):
            raise OperatorError(f"{run} is one behavior that was commanded: command another one")
        return runner

    async def preview(self, run: RunId, prepared: Prepared) -> RevisionPreview:
        """Return what a revision does, and what follows."""
        plan, loaded = prepared.plan, prepared.mission
        approval = await self._starter.approvals.state(loaded.file, loaded.source, loaded.library)
        possible = not (plan.refusals or has_errors(prepared.findings))
        state = self._runner(run).run.state
        return RevisionPreview(
            run,
            loaded.file,
            plan.digest,
            plan.version,
            plan.previous,
            (
                *described(plan.difference),
                *_monitored(state, prepared.item.requirements),
            ),
            tuple(
                RevisionEffect(
                    each.kind.value,
                    each.element,
                    each.token,
                    each.text,
                    _commanded(state, each.token),
                )
                for each in plan.effects
            ),
            tuple(
                RevisionRefusal(
                    each.element,
                    each.token,
                    each.text,
                    each.candidates,
                    tuple(called(loaded.elements[id_]) for id_ in each.candidates),
                    _commanded(state, each.token),
                    each.can_end,
                )
                for each in plan.refusals
            ),
            prepared.findings,
            await self._outlooks.outlook(run, prepared.item) if possible else None,
            "" if approval.may_start else str(approval),
            self._needs().busy(run, plan.difference),
        )

    def _needs(self) -> NeedsOfRevisions:
        supervisor = self._supervisor
        taken = supervisor.handover.taken
        return NeedsOfRevisions(
            supervisor.fleet, supervisor.availability, taken, supervisor.runners
        )

    async def refuse(self, run: RunId, prepared: Prepared, plan: str) -> None:
        """Check that a revision may be carried out.

        Raises:
            MissionError: the new version is not well, or does not fit the fleet.
            NotApprovedError: persons must approve it before.
            OperatorError: it is refused, or its plan is another one than that which was seen.
        """
        loaded = prepared.mission
        if has_errors(prepared.findings):
            fleet = self._supervisor.fleet.file
            raise MissionError(f"{loaded.file} cannot run with fleet {fleet}", prepared.findings)
        await self._starter.approvals.refuse_unapproved(loaded.file, loaded.source, loaded.library)
        if prepared.plan.refusals:
            why = "; ".join(each.text for each in prepared.plan.refusals)
            raise OperatorError(f"{run} is not revised: {why}")
        if prepared.plan.digest != plan:
            raise OperatorError(
                f"{run} is not revised: the run or the file is another one since the plan was "
                "made: look at the new plan"
            )

    async def outlook(self, run: RunId, prepared: Prepared) -> IncidentPreview:
        """Explore whether the mission completes after a revision."""
        return await self._outlooks.outlook(run, prepared.item)

    def hand_over(self, run: RunId, prepared: Prepared) -> None:
        """Give a revised run the routes, areas and points of operators that it has not."""
        runner = self._supervisor.runner(run)
        for geometry in self._supervisor.geometries_given(prepared.mission):
            if geometry.name not in runner.run.state.geometries:
                runner.post(geometry)


def _commanded(state: RunState, number: int) -> tuple[str, ...]:
    """Return the vehicles and payloads of a token and of all tokens within its activity."""
    token = state.tokens.get(number)  # the run may have gone on since the plan was made
    found: dict[str, None] = {}
    waiting = [token] if token is not None else []
    while waiting:
        each = waiting.pop()
        if each.behavior:
            found.update(dict.fromkeys(state.behaviors[each.behavior].resources))
        if each.inner is not None:
            waiting.extend(each.inner.tokens.values())
    return tuple(sorted(found))


def described(difference: Difference) -> Sequence[str]:
    """Return what differs between two versions, as sentences for people."""
    lines = [f"new: {each.kind} {_name(each)}" for each in difference.added]
    lines += [f"removed: {each.kind} {_name(each)}" for each in difference.removed]
    lines += [
        f"changed: {each.element.kind} {_name(each.element)} ({', '.join(map(_words, each.what))})"
        for each in difference.changed
    ]
    lines += [
        f"changed: {name!r}, a route, area or point of the file" for name in difference.geometries
    ]
    return lines


def _monitored(state: RunState, now: Sequence[MonitoredRequirement]) -> Sequence[str]:
    """Return what becomes of the requirements that the run is monitored for."""
    if not now and not state.requirements:
        return []
    from m2pem.monitors.selection import carried_over  # noqa: PLC0415  # as in `_requirements`

    before = state.requirements
    goes_on = carried_over(before, now)
    lines = [
        f"requirement {each.id}: monitored from here on"
        f"{', with another formula' if each.id in before else ''}"
        for each in now
        if each.id not in goes_on
    ]
    left = before.keys() - {each.id for each in now}
    return lines + [f"requirement {each}: no longer monitored" for each in sorted(left)]


def _name(element: object) -> str:
    label, id_ = getattr(element, "label", ""), getattr(element, "id", "")
    return f"{label!r} ({id_})" if label != id_ else str(id_)


def _words(field: str) -> str:
    return field.replace("_", " ")
