"""Verification of a mission against a fleet: the search request, the search and its findings."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from m2pem.executive.fleet_connections import FleetArbiters
from m2pem.executive.loading import findings_for, refuse_errors
from m2pem.fleet.default_fleet import fleet_for
from m2pem.fleet.fleet import Fleet
from m2pem.mission.elements import ErrorPolicy
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value
from m2pem.verify.assumptions import NOTHING, Assumptions
from m2pem.verify.check import Report, check
from m2pem.verify.properties.results import Result
from m2pem.verify.report.findings import Findings, findings_of
from m2pem.verify.requirements import (
    Names,
    Requirement,
    assumptions_given,
    begins_all_pools,
    collect,
    read_assumptions,
)
from m2pem.verify.requirements.results import with_requirements
from m2pem.verify.search.explore import Limits, Progress
from m2pem.verify.spin.queries import Storage
from m2pem.verify.translate.context import behavior_of, may_be_preempted
from m2pem.verify.translate.options import Options
from m2pem.verify.translate.participants import begun_by_nothing, participants
from m2pem.verify.translate.ways import KnownWays
from m2pem.verify.under_assumptions import check_under_assumptions

if TYPE_CHECKING:
    from m2pem.plugins import Plugins

IN_ORDER = "timers that begin to run together come in the order of their times (--timers in-order)"
"""The note in reports whose answers assume that order."""


ENDS_THE_RUN = (
    "an error that no event catches ends the run, as if the operator chose `end` about its "
    "incident; what follows another choice is explored when there is an incident"
)
"""The note in reports of missions whose errors open incidents."""

PREEMPTED_AT_ANY_TIME = (
    "the fleet allows preemption: a task of another run with a greater priority may take the "
    "vehicle of a task at any time (PREEMPTED), and what it has taken is free again at once"
)
"""The note in reports of missions whose tasks may be preempted."""


def known_ways(fleet: Fleet, mission: Mission) -> KnownWays | None:
    """Return where the vehicles of a fleet go in a mission; None: it has no shared space."""
    if not fleet.shared_space:
        return None
    # Few fleets need it.
    from m2pem.deconfliction.known_ways import FleetWays  # noqa: PLC0415

    return FleetWays(fleet, mission.geometries)


@dataclass(frozen=True, slots=True)
class SearchRequest:
    """What is searched. `process`: None for the main one; `data`: what a run begins with.
    `assumed`: what the whole check assumes.
    """

    mission: Mission
    fleet: Fleet
    process: str | None
    data: Mapping[str, Value]
    options: Options
    requirements: Sequence[Requirement] = ()
    assumed: Assumptions = NOTHING


@dataclass(frozen=True, slots=True)
class SearchEngine:
    """The search engine (`builtin`, `spin`), how Spin stores states, and where the search ends."""

    name: str
    storage: str
    limits: Limits


def search_request(
    mission: Mission,
    arbiters: FleetArbiters | None,
    plugins: "Plugins",
    process: str | None,
    data: Mapping[str, Value],
    spec: Path | bytes | None = None,
    *,
    timers_in_order: bool = False,
    assume: Iterable[str] = (),
    all_pools: bool = False,
) -> SearchRequest:
    """What is to be searched, if `m2pem check` finds no errors in it.

    `arbiters` None: a fleet is made up, and the mission's roles are not checked. `spec`: more
    requirements, a file or its text. `assume`: what the whole check assumes, beside what the
    mission's file says. `all_pools`: the pools that nothing triggers begin with the run, also if
    the file does not say so.

    Raises:
        MissionError: there are errors; it has all of them.
        RequirementsError: requirements cannot be read, or do not fit; it has all findings.
    """
    wrong = findings_for(mission, arbiters, plugins, data, process)
    refuse_errors(f"{mission.file} cannot be verified: `m2pem check` finds errors", wrong)
    writes = plugins.service_writes()
    fleet = arbiters.fleet if arbiters is not None else fleet_for(mission)
    options = Options(
        data=data,
        service_writes=writes,
        timers_in_order=timers_in_order,
        all_pools=all_pools or begins_all_pools(mission),
        catalogue=arbiters.offered if arbiters is not None else None,
        ways=known_ways(fleet, mission),
    )
    names = Names(mission, fleet, writes, data)
    assumed = assumptions_given(assume, names)
    assumed &= read_assumptions(names, mission.process(process))
    requirements = collect(names, spec)
    return SearchRequest(mission, fleet, process, data, options, requirements, assumed)


def search(
    request: SearchRequest,
    engine: SearchEngine,
    *,
    strict: bool,
    progress: Callable[[Progress], None] | None = None,
    decided: Callable[[Result], None] | None = None,
) -> Findings:
    """Search, and return what was found.

    `decided` gets each result as soon as it is certain; Spin's come at the end, and where something
    is assumed, all do: beside each is its verdict without the assumptions.
    """
    assumes = bool(request.assumed) or any(each.assumed for each in request.requirements)
    report = check_under_assumptions(
        _Checks(request, engine, progress, None if assumes else decided),
        request.requirements,
        request.assumed,
        engine.limits,
        short=_Checks(request, replace(engine, name="builtin", storage="exact"), progress),
    )
    if request.assumed:
        report = replace(report, notes=(*report.notes, _assumed(request.assumed)))
    if request.options.timers_in_order:
        report = replace(report, notes=(*report.notes, IN_ORDER))
    report = replace(report, notes=(*report.notes, *_pools(request)))
    if _opens_incidents(request):
        report = replace(report, notes=(*report.notes, ENDS_THE_RUN))
    behaviors = map(behavior_of, request.mission.activities())
    if any(may_be_preempted(request.fleet, each) for each in behaviors):
        report = replace(report, notes=(*report.notes, PREEMPTED_AT_ANY_TIME))
    return replace(
        findings_of(request.mission, report, strict=strict, given=request.data),
        together=_together(request),
    )


def _pools(request: SearchRequest) -> Iterator[str]:
    """Say which processes are not begun, and which only here."""
    mission = request.mission
    root = mission.process(request.process)
    pools = {each.process_id: each for each in mission.participants}
    together = _together(request)
    for each in begun_by_nothing(mission, root):
        pool = pools.get(each.id)
        name = f"pool {pool.name or pool.id} (process {each.id})" if pool else f"process {each.id}"
        if each.id in together:
            yield f"{name} begins with the run here; a run of the executive does not begin it"
            continue
        why = f"a run begins with {root.id}, nothing calls {each.id}, and it has no trigger"
        yield f"{name} is not begun: {why}{'; --all-pools begins it, too' if pool else ''}"


def _together(request: SearchRequest) -> tuple[str, ...]:
    """The ids of the processes that begin with the run."""
    root = request.mission.process(request.process)
    begun = participants(request.mission, root) if request.options.all_pools else []
    return tuple(each.id for each in begun)


def _assumed(assumed: Assumptions) -> str:
    return (
        f"assumed: {assumed.english}; where nothing else is said, a verdict is the same without "
        "that"
    )


def _opens_incidents(request: SearchRequest) -> bool:
    said = [process.on_error for process in request.mission.processes]
    return ErrorPolicy.INCIDENT in said or (
        None in said and request.fleet.on_error is ErrorPolicy.INCIDENT
    )


@dataclass(frozen=True, slots=True)
class _Checks:
    """The checks of a request by one engine."""

    request: SearchRequest
    engine: SearchEngine
    progress: Callable[[Progress], None] | None
    decided: Callable[[Result], None] | None = None

    def properties(self, assumed: Assumptions, limits: Limits) -> Report:
        """Check every property of missions."""
        request = self.request
        if self.engine.name == "spin":
            from m2pem.verify.spin.check import check_with_spin  # noqa: PLC0415  # seldom wanted

            return check_with_spin(
                request.mission,
                request.fleet,
                process=request.process,
                options=replace(request.options, assumed=assumed),
                limits=limits,
                storage=Storage(self.engine.storage),
                progress=self.progress,
            )
        return check(
            request.mission,
            request.fleet,
            process=request.process,
            options=replace(request.options, assumed=assumed),
            limits=limits,
            progress=self.progress,
            decided=self.decided,
        )

    def requirements(
        self, report: Report, asked: Sequence[Requirement], assumed: Assumptions, limits: Limits
    ) -> Report:
        """Return the report with the results of requirements added."""
        request = self.request
        return with_requirements(
            report,
            request.mission,
            request.fleet,
            asked,
            process=request.process,
            options=replace(request.options, assumed=assumed),
            limits=limits,
            storage=Storage(self.engine.storage),
            progress=self.progress,
            decided=self.decided,
        )
