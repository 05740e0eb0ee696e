"""The executive as the scheduler sees it: what begins a run, and what a start waits for."""

from collections.abc import Callable

from m2pem.allocation.candidates import Candidates, Facts
from m2pem.api.authoring import MissionFiles
from m2pem.api.clock import Clock
from m2pem.api.runs import RunId
from m2pem.api.telemetry import LinkState
from m2pem.errors import ScheduleError
from m2pem.executive.loading import load_source
from m2pem.executive.run_starter import RunStarter
from m2pem.executive.supervisor import Supervisor
from m2pem.fleet.allocation import resources_of_mission
from m2pem.fleet.fleet import Fleet, real_resources
from m2pem.journal.base import Journal
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.mission import Mission
from m2pem.scheduling.entry import EntryChange, SchedulePlan
from m2pem.telemetry.bus import Bus


class ScheduledRuns:
    """Starts missions on an executive, and says what it knows of them."""

    def __init__(self, supervisor: Supervisor, starter: RunStarter, bus: Bus) -> None:
        self._supervisor = supervisor
        self._starter = starter
        self._bus = bus

    @property
    def fleet(self) -> Fleet:
        """The fleet of the executive."""
        return self._supervisor.fleet

    @property
    def journal(self) -> Journal:
        """The journal, which also has the schedule."""
        return self._supervisor.journal

    @property
    def clock(self) -> Clock:
        """The executive's clock."""
        return self._supervisor.clock

    def admitted(self, plan: SchedulePlan) -> tuple[Mission, str]:
        """Read and check the mission of an entry of the schedule; returns it with its process. It
        blocks.

        Raises:
            MissionError: with every finding.
            ScheduleError: the fleet does not allow that it starts unattended.
        """
        refuse_unattended(self.fleet)
        files = MissionFiles(plan.mission_name, plan.mission, plan.library)
        loaded = load_source(files)
        process, _ = self._starter.admit(loaded, plan.process, plan.data)
        return loaded, process

    async def unapproved(self, plan: SchedulePlan) -> str:
        """Who must approve the mission of an entry before it may start; "": no approval is
        needed.

        Raises:
            JournalError: the journal cannot be read.
        """
        state = await self._starter.approvals.state(plan.mission_name, plan.mission, plan.library)
        return "" if state.may_start else str(state)

    def has_others(self) -> bool:
        """Whether other executives are on the journal now; it blocks."""
        return self._supervisor.settings.has_others()

    async def begin_scheduled(
        self,
        loaded: Mission,
        process: str,
        plan: SchedulePlan,
        by: str,
        started: EntryChange,
        still: Callable[[], bool],
    ) -> RunId:
        """Begin a run together with the new state of the entry that starts it.

        `still`: whether it may begin, asked when the journal has both.

        Raises:
            NotBegunError: it may not, or its beginning could not be written.
            M2pemError: nothing was written.
        """
        return await self._starter.begin_if_free(
            loaded, process, plan.data, by, started=started, still=still
        )

    def outcome_of(self, run: RunId) -> str | None:
        """How a run has ended; "": it goes on; None: it is not driven here."""
        runner = self._supervisor.runners.get(run)
        if runner is None:
            return None
        outcome = runner.run.state.outcome
        return outcome.value if runner.done.is_set() and outcome is not None else ""

    def users(self) -> dict[ResourceId, str]:
        """What runs and operators use: all that a run names until it has ended."""
        found: dict[ResourceId, str] = {}
        handover = self._supervisor.handover
        for resource, holder in handover.holders().items():
            if holder and resource not in handover.taken:
                found[resource] = f"{holder} has it"
        for runner in self._supervisor.runners.values():
            if not runner.done.is_set():
                for resource in resources_of_mission(runner.run.state.mission, self.fleet):
                    found[resource] = f"{runner.id} uses it"
        for resource, operator in handover.taken.items():
            found[resource] = f"{operator} has it"
        return found

    def unusable(self, resource: ResourceId) -> str:
        """Why no mission gets a resource now; "": nothing is known against it, nor its vehicle."""
        if reason := self._supervisor.availability.reason(resource):
            return reason
        vehicle = ResourceId(resource.partition("/")[0])
        state = self._bus.latest(vehicle)
        if state is None:  # what only carries payloads may say nothing itself
            return "nothing was received from it yet" if resource == vehicle else ""
        return "its link is lost" if state.link is LinkState.LOST else ""

    def facts(self, vehicle: ResourceId) -> Facts:
        """The facts of a vehicle now, as conditions of the schedule read them."""
        graph = self._supervisor.arbiters.graph
        return Candidates(self.fleet, graph, self._bus.latest).facts(vehicle)


def refuse_unattended(fleet: Fleet) -> None:
    """Check that missions may start with no operator present.

    Raises:
        ScheduleError: the fleet has real vehicles, and its file does not say that they may.
    """
    real = real_resources(fleet)
    if real and not fleet.unattended:
        raise ScheduleError(
            f"{', '.join(real)} of {fleet.file} would start with no operator present: say "
            "`schedule: {unattended: true}` in the fleet file if they may"
        )
