"""Verification of a mission against a fleet: what is searched, and what is told of it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from m2pem.executive.fleet_connections import FleetArbiters
from m2pem.executive.loading import findings_for, refuse_errors
from m2pem.fleet.default_fleet import fleet_for
from m2pem.fleet.fleet import Fleet
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value
from m2pem.verify.check import Report, check
from m2pem.verify.report.findings import Findings, findings_of
from m2pem.verify.requirements import Names, Requirement, collect
from m2pem.verify.requirements.results import with_requirements
from m2pem.verify.search.explore import Limits, Progress
from m2pem.verify.spin.queries import Storage
from m2pem.verify.translate.options import Options

if TYPE_CHECKING:
    from m2pem.plugins import PluginManager

IN_ORDER = "timers that begin to run together come in the order of their times (--timers in-order)"
"""What is told of answers to which that was assumed."""


@dataclass(frozen=True, slots=True)
class Asked:
    """What is to be searched. `process`: None for the main one; `data`: what a run begins with."""

    mission: Mission
    fleet: Fleet
    process: str | None
    data: Mapping[str, Value]
    options: Options
    requirements: Sequence[Requirement] = ()


@dataclass(frozen=True, slots=True)
class Engine:
    """Who searches (`builtin`, `spin`), how Spin remembers states, and where the search ends."""

    name: str
    storage: str
    limits: Limits


def asked_of(
    mission: Mission,
    arbiters: FleetArbiters | None,
    plugins: "PluginManager",
    process: str | None,
    data: Mapping[str, Value],
    spec: Path | bytes | None = None,
    *,
    simulated: bool = False,
    timers_in_order: bool = False,
) -> Asked:
    """What is to be searched, if `m2pem check` finds no errors in it.

    `arbiters` None: a fleet is made up, and the mission's roles are not checked. `spec`: more
    requirements, a file or its text.

    Raises:
        MissionError: there are errors; tells them all.
        RequirementsError: requirements cannot be read, or do not fit; tells all that is wrong.
    """
    wrong = findings_for(mission, arbiters, plugins, tuple(data), process, simulated=simulated)
    refuse_errors(f"{mission.file} cannot be verified: `m2pem check` finds errors", wrong)
    writes = plugins.service_writes()
    options = Options(data=data, service_writes=writes, timers_in_order=timers_in_order)
    fleet = arbiters.fleet if arbiters is not None else fleet_for(mission)
    requirements = collect(Names(mission, fleet, writes, data), spec)
    return Asked(mission, fleet, process, data, options, requirements)


def prove(
    asked: Asked,
    engine: Engine,
    *,
    strict: bool,
    progress: Callable[[Progress], None] | None = None,
) -> Findings:
    """Search, and tell what was found."""
    report = with_requirements(
        _report(asked, engine, progress),
        asked.mission,
        asked.fleet,
        asked.requirements,
        process=asked.process,
        options=asked.options,
        limits=engine.limits,
        storage=Storage(engine.storage),
        progress=progress,
    )
    if asked.options.timers_in_order:
        report = replace(report, notes=(*report.notes, IN_ORDER))
    return findings_of(asked.mission, report, strict=strict, given=asked.data)


def _report(asked: Asked, engine: Engine, progress: Callable[[Progress], None] | None) -> Report:
    if engine.name == "spin":
        from m2pem.verify.spin.check import check_with_spin  # noqa: PLC0415  # seldom wanted

        return check_with_spin(
            asked.mission,
            asked.fleet,
            process=asked.process,
            options=asked.options,
            limits=engine.limits,
            storage=Storage(engine.storage),
            progress=progress,
        )
    return check(
        asked.mission,
        asked.fleet,
        process=asked.process,
        options=asked.options,
        limits=engine.limits,
        progress=progress,
    )
