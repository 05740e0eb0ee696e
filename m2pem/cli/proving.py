"""What `m2pem verify` was told, put together: mission, fleet and options, and who searches."""

import signal
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from m2pem.model.mission import Mission
    from m2pem.model.values import Value
    from m2pem.resources.fleet import Fleet
    from m2pem.verify.check import Report
    from m2pem.verify.derive.options import Options
    from m2pem.verify.explore import Limits, Progress
    from m2pem.verify.report.findings import Findings
    from m2pem.verify.requirements import Requirement

_QUIET_S = 1.0
"""A search that takes less is over before anybody has read how far it is."""
_BETWEEN_LINES_S = 0.2
IN_ORDER = "timers that begin to run together come in the order of their times (--timers in-order)"
"""What is told of answers to which that was assumed."""


@dataclass(frozen=True, slots=True)
class Asked:
    """What is to be searched. `process`: None for the main one; `data`: what a run begins with."""

    mission: "Mission"
    fleet: "Fleet"
    process: str | None
    data: "Mapping[str, Value]"
    options: "Options"
    requirements: "Sequence[Requirement]" = ()


@dataclass(frozen=True, slots=True)
class Engine:
    """Who searches (`builtin`, `spin`), how Spin remembers states, and where the search ends."""

    name: str
    storage: str
    limits: "Limits"


def asked_of(
    mission: "Mission",
    fleet_file: str | None,
    process: str | None,
    data: "Mapping[str, Value]",
    spec: Path | None = None,
) -> Asked:
    """What is to be searched, if `m2pem check` finds no errors in it. `spec`: more requirements.

    Raises:
        MissionError: there are errors; tells them all.
        FleetError: the fleet cannot be used.
        RequirementsError: requirements cannot be read, or do not fit; tells all that is wrong.
    """
    from m2pem.cli.fleets import arbiters_of
    from m2pem.cli.given import get_fleet
    from m2pem.executive.loading import findings_for, refuse_errors
    from m2pem.plugins import PluginManager
    from m2pem.resources.madeup import fleet_for
    from m2pem.verify.derive.options import Options
    from m2pem.verify.requirements import Names, gather

    plugins = PluginManager()
    fleet = get_fleet(fleet_file, mission) if fleet_file is not None else None
    arbiters = arbiters_of(fleet, plugins) if fleet is not None else None
    wrong = findings_for(mission, arbiters, plugins, tuple(data), process)
    refuse_errors(f"{mission.file} cannot be verified: `m2pem check` finds errors", wrong)
    writes = {name: tuple(plugins.service(name)().writes) for name in plugins.services()}
    options = Options(data=data, service_writes=writes)
    fleet = fleet or fleet_for(mission)
    requirements = gather(Names(mission, fleet, writes, data), spec)
    return Asked(mission, fleet, process, data, options, requirements)


def with_timers(asked: Asked, *, in_order: bool) -> Asked:
    """The same, with timers that begin together `in_order` of their times, or in any order."""
    return replace(asked, options=replace(asked.options, timers_in_order=in_order))


def findings(asked: Asked, engine: Engine, *, strict: bool) -> "Findings":
    """Search, and tell what was found."""
    from m2pem.verify.report.findings import findings_of
    from m2pem.verify.requirements.results import with_requirements
    from m2pem.verify.spin.asking import Storage

    with _ended_as_by_hand(), progress() as show:
        report = with_requirements(
            _report(asked, engine, show),
            asked.mission,
            asked.fleet,
            asked.requirements,
            process=asked.process,
            options=asked.options,
            limits=engine.limits,
            storage=Storage(engine.storage),
            progress=show,
        )
    if asked.options.timers_in_order:
        report = replace(report, notes=(*report.notes, IN_ORDER))
    return findings_of(asked.mission, report, strict=strict, given=asked.data)


def _report(asked: Asked, engine: Engine, show: "Callable[[Progress], None] | None") -> "Report":
    if engine.name == "spin":
        from m2pem.verify.spin.asking import Storage
        from m2pem.verify.spin.checking import check_with_spin

        return check_with_spin(
            asked.mission,
            asked.fleet,
            process=asked.process,
            options=asked.options,
            limits=engine.limits,
            storage=Storage(engine.storage),
            progress=show,
        )
    from m2pem.verify.check import check

    return check(
        asked.mission,
        asked.fleet,
        process=asked.process,
        options=asked.options,
        limits=engine.limits,
        progress=show,
    )


def promela(asked: Asked) -> str:
    """The model that Spin would be given."""
    from m2pem.verify.derive import derive
    from m2pem.verify.simplify import simplify
    from m2pem.verify.spin.promela import text_of

    system = derive(asked.mission, asked.fleet, process=asked.process, options=asked.options)
    return text_of(simplify(system)).text


@contextmanager
def _ended_as_by_hand() -> Iterator[None]:
    """What else asks a program to end does what Ctrl-C does: what was seen is told, Spin ends."""
    before = {}
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is signal.SIG_DFL:
            before[number] = signal.signal(number, signal.default_int_handler)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def progress() -> "Iterator[Callable[[Progress], None] | None]":
    """A line on standard error that counts up, for a person who looks."""
    if not sys.stderr.isatty():
        yield None
        return
    shown_at = 0.0

    def show(searched: "Progress") -> None:
        nonlocal shown_at
        now = time.monotonic()
        if searched.seconds > _QUIET_S and now > shown_at + _BETWEEN_LINES_S:
            shown_at = now
            _write(f"\r\033[K{_line(searched)} (Ctrl-C to stop)")

    try:
        yield show
    finally:
        if shown_at:
            _write("\r\033[K")


def _line(searched: "Progress") -> str:
    said = [f"searching for {searched.seconds:.0f} s"]
    if searched.states:
        said.append(f"{searched.states:,} states found")
    if searched.waiting:
        said.append(f"{searched.waiting:,} of them to be searched")
    return ", ".join(said)


def _write(text: str) -> None:
    print(text, end="", file=sys.stderr, flush=True)
