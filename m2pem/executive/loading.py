"""Getting a mission: from a path, a URL or bytes; and checking it against the fleet."""

import logging
from collections.abc import Collection, Container, Iterable, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote, urlsplit

from m2pem.api.authoring import Draft, MissionFiles, MissionSource
from m2pem.bpmn import parse_mission
from m2pem.bpmn.lint import by_file, lint
from m2pem.bpmn.rules.files import TOO_LARGE, UNREADABLE_FILE
from m2pem.bpmn.search_path import SearchPath
from m2pem.bpmn.xml import max_bytes, too_large
from m2pem.engine.inputs import MonitoredRequirement
from m2pem.errors import MissionError
from m2pem.executive.fleet_connections import FleetArbiters
from m2pem.findings import Finding, Severity, has_errors, unreadable_remedy
from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.check import check_mission, check_named
from m2pem.fleet.default_fleet import fleet_for
from m2pem.fleet.fleet import Fleet
from m2pem.mission.elements import ServiceTask
from m2pem.mission.library import KeptLibrary
from m2pem.mission.mission import Mission
from m2pem.suggestions import suggest_or
from m2pem.teams.turn_check import check_turns

if TYPE_CHECKING:
    from m2pem.plugins import Plugins

log = logging.getLogger("m2pem.loading")

FETCH_TIMEOUT_S = 10.0


def load_source(mission: MissionSource, search_path: Iterable[Path] = ()) -> Mission:
    """Read a mission, and the files that it uses.

    `search_path`: folders to look in for what it calls, after its own; one that did not come from a
    file has none of its own.

    Raises:
        MissionError: it cannot be read, is too big, or is wrong; with every finding.
    """
    if isinstance(mission, bytes):
        return parse_mission(mission, "mission.bpmn", library_of(mission, search_path))
    if isinstance(mission, Draft):
        return parse_mission(mission.source, str(mission.path), library_of(mission, search_path))
    if isinstance(mission, MissionFiles):
        return parse_mission(mission.source, mission.file, KeptLibrary(mission.library))
    if isinstance(mission, str):
        parts = urlsplit(mission)
        if parts.scheme in ("http", "https"):
            name = Path(unquote(parts.path)).name or mission
            return parse_mission(_fetch(mission), name, SearchPath(None, search_path))
        mission = Path(unquote(parts.path)) if parts.scheme == "file" else Path(mission)
    try:
        if (size := mission.stat().st_size) > max_bytes():
            raise _too_large(str(mission), size)
        source = mission.read_bytes()
    except OSError as error:
        reason = error.strerror or str(error)
        raise _unreadable(str(mission), reason, unreadable_remedy(error)) from error
    return parse_mission(source, str(mission), SearchPath(mission, search_path))


def library_of(mission: bytes | Draft, search_path: Iterable[Path]) -> SearchPath:
    """The files that a mission may use which did not come from a file."""
    folders = [mission.path.parent] if isinstance(mission, Draft) else []
    return SearchPath(None, [*folders, *search_path])


def _fetch(url: str) -> bytes:
    from urllib.error import URLError  # noqa: PLC0415  # slow to load, and most missions are files
    from urllib.request import urlopen  # noqa: PLC0415

    try:
        with urlopen(url, timeout=FETCH_TIMEOUT_S) as response:
            content: bytes = response.read(max_bytes() + 1)
    except (URLError, OSError, ValueError) as error:
        raise _unreadable(url, str(error)) from error
    if len(content) > max_bytes():
        raise _too_large(url, None)
    return content


def _too_large(name: str, size: int | None) -> MissionError:
    message, remedy = too_large(size)
    finding = TOO_LARGE.finding(name, 0, "", message, remedy)
    return MissionError(f"{name} cannot be read", [finding])


def _unreadable(name: str, why: str, remedy: str = "check the path") -> MissionError:
    finding = UNREADABLE_FILE.finding(name, 0, "", f"cannot be read: {why}", remedy)
    return MissionError(f"{name} cannot be read", [finding])


def findings_for(
    mission: Mission,
    arbiters: FleetArbiters | None,
    plugins: "Plugins",
    data: Iterable[str] = (),
    process: str | None = None,
    *,
    handed_over: Container[str] = (),
) -> list[Finding]:
    """All findings of `m2pem check` for a mission that was read: its own, the fleet's, plugins'.

    `data`: names given at start (`--data`), with values in a mapping. `arbiters` None: no fleet, so
    roles are only checked to be there. `handed_over`: geometries that operators have handed over.
    """
    writes = plugins.service_writes()
    findings = [*mission.warnings, *lint(mission, data, writes, _behavior_writes(arbiters))]
    beginning = [each.id for each in mission.processes if not each.global_task]
    if process is not None and process not in beginning:
        findings.append(
            Finding(
                Severity.ERROR,
                mission.file,
                0,
                process,
                "unknown-process",
                f"there is no process {process!r}",
                f"name one of: {', '.join(beginning)}",
            )
        )
    fleet = arbiters.fleet if arbiters is not None else None
    if arbiters is not None:
        offered = arbiters.offered
        findings += check_mission(mission, arbiters.fleet, offered, handed_over)
        findings += check_turns(mission, arbiters.fleet)
    else:
        findings += check_named(mission)
    findings += _unprovided(mission, writes)
    findings += plugins.check_mission(mission, fleet)
    order = by_file(mission)
    return sorted(findings, key=lambda each: (order(each), each.line, each.element, each.rule))


def _behavior_writes(arbiters: FleetArbiters | None) -> dict[str, tuple[str, ...]]:
    """What behaviors write, by name: those that all arbiters share, and those of the fleet."""
    offered = [] if arbiters is None else list(arbiters.catalogue().values())
    writes: dict[str, tuple[str, ...]] = {}
    for spec in chain(SHARED.values(), *offered):
        writes[spec.name] = (*writes.get(spec.name, ()), *spec.writes)
    return writes


def _unprovided(mission: Mission, services: Collection[str]) -> list[Finding]:
    """Return findings of service tasks whose class no plugin registered.

    Warnings: an answers file can stand in for a service, and the plugin may be installed elsewhere.
    """
    return [
        Finding(
            Severity.WARNING,
            mission.file_of(task),
            task.call.line,
            task.id,
            "unknown-service",
            f"no plugin provides the service {task.call.service!r}; in a run it fails",
            suggest_or(task.call.service, services, "install the plugin that does"),
        )
        for task in mission.activities()
        if isinstance(task, ServiceTask) and task.call and task.call.service not in services
    ]


def refuse_errors(what: str, findings: Sequence[Finding]) -> None:
    """Raise MissionError with all findings when any of them is an error."""
    if has_errors(findings):
        raise MissionError(what, findings)


_ELEMENT = b"requirement"
_WRITTEN = (_ELEMENT, b"assume")


def requirement_findings(
    mission: Mission,
    arbiters: FleetArbiters | None,
    plugins: "Plugins",
    data: Iterable[str] = (),
) -> list[Finding]:
    """All of them. `data`: names given at start; `arbiters` None: a fleet is made up."""
    if not any(each in mission.source for each in _WRITTEN):
        return []  # most have none, and what reads them takes time to load
    from m2pem.verify.requirements import Names, collect, read_assumptions  # noqa: PLC0415
    from m2pem.verify.requirements.requirement import RequirementsError  # noqa: PLC0415

    writes = plugins.service_writes()
    fleet = arbiters.fleet if arbiters is not None else fleet_for(mission)
    names = Names(mission, fleet, writes, data)
    found: list[Finding] = []
    for process in mission.processes:
        try:
            read_assumptions(names, process)
        except RequirementsError as error:  # no run needs them
            found += [replace(each, severity=Severity.WARNING) for each in error.findings]
    try:
        collect(names)
    except RequirementsError as error:
        found += error.findings
    return found


def has_requirements(mission: Mission) -> bool:
    """Whether the mission's file may have requirements; what reads them takes time to load."""
    return _ELEMENT in mission.source


def monitored_requirements(
    mission: Mission,
    fleet: Fleet,
    plugins: "Plugins",
    data: Iterable[str] = (),
    spec: Path | bytes | None = None,
) -> tuple[MonitoredRequirement, ...]:
    """Return the requirements that a run of a mission is monitored for: those in its file, and
    those of a spec file, or of its text. A warning of the log names those of them that cannot be
    monitored.

    Raises:
        RequirementsError: with every finding.
    """
    if spec is None and not has_requirements(mission):
        return ()
    # What reads formulas takes time to load, and most runs have none.
    from m2pem.monitors.selection import can_be_monitored, monitored  # noqa: PLC0415
    from m2pem.verify.requirements import Names, collect  # noqa: PLC0415

    names = Names(mission, fleet, plugins.service_writes(), data)
    required = collect(names, spec)
    left_out = [each.id for each in required if each.monitor and not can_be_monitored(each)]
    if spec is not None and left_out:
        text = "the run is not monitored for %s: only `m2pem verify` counts single steps"
        log.warning(text, ", ".join(left_out))
    return monitored(required)
