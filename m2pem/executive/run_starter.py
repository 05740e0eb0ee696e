"""Starting missions on an executive: each is checked, and begins if what it names is free."""

import asyncio
import time
from collections.abc import Callable, Collection, Mapping
from typing import Any

from m2pem.allocation.assignment import load_solver
from m2pem.api.alerts import AlertSeverity
from m2pem.api.allocation import RoleAssignment, StartPreview
from m2pem.api.authoring import MissionSource, file_of
from m2pem.api.runs import APPROVAL, Alert, RunId
from m2pem.engine.inputs import MonitoredRequirement, StartRun
from m2pem.engine.run import MissionRun
from m2pem.engine.state import RunStatus
from m2pem.errors import BusyError, M2pemError, MissionError, NotApprovedError
from m2pem.executive.approvals import Approvals
from m2pem.executive.handover import refuse_busy_resources
from m2pem.executive.loading import (
    findings_for,
    has_requirements,
    load_source,
    monitored_requirements,
    refuse_errors,
    requirement_findings,
)
from m2pem.executive.supervisor import Supervisor
from m2pem.findings import Finding
from m2pem.fleet.allocation import resources_of, roles_of_mission
from m2pem.fleet.fleet import dump
from m2pem.fleet.space import waits_for_space
from m2pem.journal.base import RunHeader
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value
from m2pem.scheduling.entry import EntryChange

CHANGED = "a geometry that it names was handed over anew as it was to begin; look at it again"


class NotBegunError(M2pemError):
    """A run was created, and nothing of it has begun."""

    def __init__(self, run: RunId, reason: str) -> None:
        self.run = run
        super().__init__(reason)


class RunStarter:
    """Checks missions and begins their runs, which the supervisor drives then."""

    def __init__(self, supervisor: Supervisor) -> None:
        self._supervisor = supervisor
        self.approvals = Approvals(
            supervisor.fleet,
            supervisor.journal,
            lambda: supervisor.fleet_now.geometries,
            lambda: supervisor.drawings.drawn_by,
            supervisor.clock.now_us,
            lambda text: supervisor.events.publish(Alert("", APPROVAL, text, AlertSeverity.NOTICE)),
        )
        # Of two starts at once the second must see what the first one takes.
        self._starting = asyncio.Lock()

    def admit(
        self, loaded: Mission, process: str | None, data: Mapping[str, Value] | None
    ) -> tuple[str, list[Finding]]:
        """Check a mission; returns the id of the process to begin with, and the warnings.

        Raises:
            MissionError: with every finding.
        """
        supervisor = self._supervisor
        findings = findings_for(
            loaded,
            supervisor.arbiters,
            supervisor.plugins,
            data or {},
            process,
            handed_over=supervisor.drawings.handed_over,
        )
        findings += requirement_findings(
            loaded, supervisor.arbiters, supervisor.plugins, data or {}
        )
        refuse_errors(f"{loaded.file} cannot run with fleet {supervisor.fleet.file}", findings)
        if loaded.chooses_resources or waits_for_space(supervisor.fleet):
            load_solver()
        return loaded.process(process).id, findings

    def findings(
        self, loaded: Mission, process: str | None, names: tuple[str, ...]
    ) -> list[Finding]:
        """Return all findings of `m2pem check`. `names`: those of the data that a run gets."""
        supervisor = self._supervisor
        arbiters, plugins = supervisor.arbiters, supervisor.plugins
        return [
            *findings_for(
                loaded,
                arbiters,
                plugins,
                names,
                process,
                handed_over=supervisor.drawings.handed_over,
            ),
            *requirement_findings(loaded, arbiters, plugins, names),
        ]

    async def preview(
        self, mission: MissionSource, process: str | None, names: tuple[str, ...]
    ) -> StartPreview:
        """Return what a start would begin with now, and what speaks against it."""
        supervisor = self._supervisor
        try:
            loaded = await self.read(mission)
        except MissionError as error:
            return StartPreview(file_of(mission), findings=error.findings)
        findings = await asyncio.to_thread(self.findings, loaded, process, names)
        processes = {each.id: each.name for each in loaded.processes}
        begun = process or loaded.process().id
        roles = {(each.name, each.resource): each for each in roles_of_mission(loaded)}
        fleet, busy = supervisor.fleet, ""
        try:
            self.refuse_busy(loaded)
        except BusyError as error:
            busy = str(error)
        approval = await self.approvals.state(loaded.file, loaded.source, loaded.library)
        return StartPreview(
            loaded.file,
            processes.get(begun, ""),
            begun,
            tuple(findings),
            tuple(
                RoleAssignment(each.name, each.resource, resources_of(each, fleet))
                for each in roles.values()
            ),
            busy,
            "" if approval.may_start else str(approval),
        )

    async def read(self, mission: MissionSource) -> Mission:
        """Read a mission, not in the event loop.

        Raises:
            MissionError: with every finding.
        """
        return await asyncio.to_thread(load_source, mission, self._supervisor.settings.search_path)

    def load(
        self,
        mission: MissionSource | Mission,
        process: str | None,
        data: Mapping[str, Value] | None,
    ) -> tuple[Mission, str]:
        """Read and check a mission that is to start; returns it with its process. It blocks.

        Raises:
            MissionError: with every finding.
        """
        supervisor = self._supervisor
        loaded = (
            mission
            if isinstance(mission, Mission)
            else load_source(mission, supervisor.settings.search_path)
        )
        process_id, _ = self.admit(loaded, process, data)
        return loaded, process_id

    async def start(
        self,
        mission: MissionSource | Mission,
        process: str | None,
        data: Mapping[str, Value] | None,
        by: str,
        *,
        even_if_busy: bool = False,
    ) -> RunId:
        """Begin a run. Returns when its first records are durable.

        Raises:
            MissionError: with every finding.
            BusyError: other runs or operators have what it names, unless `even_if_busy`.
            NotApprovedError: persons must approve it before.
        """
        # Reading and checking take a while, and a URL may take longer: not in the event loop.
        loaded, process_id = await asyncio.to_thread(self.load, mission, process, data)
        if even_if_busy:
            return await self.begin(loaded, process_id, data, by)
        return await self.begin_if_free(loaded, process_id, data, by)

    async def begin_if_free(
        self,
        loaded: Mission,
        process_id: str,
        data: Mapping[str, Value] | None,
        by: str,
        *,
        lent: Collection[ResourceId] = (),
        **options: Any,
    ) -> RunId:
        """Begin a run if all that its mission names is free; the options are those of `begin`.

        Raises:
            BusyError: other runs or operators have some of it.
            NotApprovedError: persons must approve it before.
        """
        async with self._starting:
            self.refuse_busy(loaded, lent)
            return await self.begin(loaded, process_id, data, by, lent=lent, **options)

    def refuse_busy(self, loaded: Mission, lent: Collection[ResourceId] = ()) -> None:
        """Check that everything that a mission names is free now, or lent to it.

        Raises:
            BusyError: other runs or operators have some of it.
        """
        supervisor = self._supervisor
        ended = RunStatus.ENDED
        over = {run for run, one in supervisor.runners.items() if one.run.state.status is ended}
        holder = supervisor.availability.holder
        taken = {
            resource: operator
            for resource, operator in supervisor.handover.taken.items()
            if resource not in lent
        }
        refuse_busy_resources(loaded, supervisor.fleet, taken, holder, over)

    async def begin(
        self,
        loaded: Mission,
        process_id: str,
        data: Mapping[str, Value] | None,
        by: str,
        *,
        started: EntryChange | None = None,
        still: Callable[[], bool] = lambda: True,
        lent: Collection[ResourceId] = (),
        direct: bool = False,
        step: bool = False,
        requirements: tuple[MonitoredRequirement, ...] | None = None,
    ) -> RunId:
        """Begin a run of a mission that was admitted. Returns when its beginning is durable.

        `started`: the new state of the entry of the schedule that starts it. `still`: whether it
        may begin, asked when the journal has created it. `lent`: what the operator who starts it
        has taken, and lets it command. `direct`: it is one behavior that is commanded from outside
        of a mission, which nobody approves. `step`: it is paused before its first step.
        `requirements`: what it is monitored for; None: the requirements of the mission's file.

        Raises:
            NotApprovedError: persons must approve it before.
            OperatorError: the arbiters are not connected yet, or interrupted runs do not have their
                vehicles yet.
            NotBegunError: a run that the schedule starts was created, and has not begun.
        """
        supervisor = self._supervisor
        supervisor.refuse_unconnected()
        supervisor.interrupted.refuse_start()
        files = loaded.file, loaded.source, loaded.library
        if requirements is None and has_requirements(loaded):
            requirements = await asyncio.to_thread(
                monitored_requirements,
                loaded,
                supervisor.fleet,
                supervisor.plugins,
                data or {},
            )
        approved = "" if direct else await self.approvals.refuse_unapproved(*files)
        header = RunHeader(
            loaded.file,
            loaded.source,
            process_id,
            dump(supervisor.fleet),
            supervisor.fleet.simulated,
            supervisor.settings.speed,
            supervisor.clock.now_us()
            if supervisor.settings.speed == 1.0
            else time.time_ns() // 1000,
            loaded.library,
        )
        number = await supervisor.journal.create(header, started)
        # From here to `drive` nothing is awaited: STOP of all finds the run, or was before it.
        if not still():
            await supervisor.journal.release(number)
            raise NotBegunError(number, "it was held as it was to begin")
        if approved and self.approvals.digest(*files[1:]) != approved:
            await supervisor.journal.release(number)
            if started is not None:
                raise NotBegunError(number, CHANGED)
            await supervisor.journal.delete([number], by=by, unended=True)
            raise NotApprovedError(f"{loaded.file} was not started: {CHANGED}", 0)
        for resource in lent:
            supervisor.availability.lend(resource, number)
        run = MissionRun(loaded, supervisor.fleet, number, supervisor.settings.steps_at_once)
        runner = supervisor.add(run, 1)
        begun = runner.submit(
            StartRun(
                process_id,
                dict(data or {}),
                by,
                supervisor.handover.by_name(lent),
                step,
                requirements or (),
                supervisor.known_conditions(requirements or ()),
            )
        )
        for geometry in supervisor.geometries_given(loaded):
            runner.post(geometry)
        supervisor.drive(runner)
        try:
            await begun
        except M2pemError as error:
            if started is None:
                raise
            await supervisor.forget(number)
            raise NotBegunError(number, str(error)) from error
        return number
