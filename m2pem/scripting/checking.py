"""Checks a mission, alone or against a fleet: what `m2pem check` prints, as objects."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Self

from m2pem.api.authoring import MissionSource
from m2pem.bpmn import NO_BPMN_RULES
from m2pem.errors import FleetError, MissionError
from m2pem.executive.loading import findings_for, requirement_findings
from m2pem.findings import Finding, Severity, has_errors, lines
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value
from m2pem.plugins import PluginManager
from m2pem.scripting.html import paragraph, table
from m2pem.scripting.sources import (
    DEFAULT_FLEET,
    FleetSource,
    arbiters_of,
    fleet_of,
    load_mission,
)


class CheckResult(tuple[Finding, ...]):
    """All findings about a mission: a tuple, empty if nothing was found.

    `usable` is False if the mission is no BPMN at all, has no such process, or the fleet cannot be
    used. `str` gives the lines that `m2pem check` prints.
    """

    usable: bool

    def __new__(cls, findings: Iterable[Finding], *, usable: bool = True) -> Self:
        result = super().__new__(cls, findings)
        result.usable = usable
        return result

    @property
    def ok(self) -> bool:
        """Whether no finding is an error: the mission can start."""
        return self.usable and not has_errors(self)

    @property
    def errors(self) -> list[Finding]:
        """The findings that stop the mission from starting."""
        return [each for each in self if each.severity is Severity.ERROR]

    @property
    def warnings(self) -> list[Finding]:
        """The findings that do not."""
        return [each for each in self if each.severity is Severity.WARNING]

    def __str__(self) -> str:
        return "\n".join(lines(self)) or "nothing found"

    def __repr__(self) -> str:
        return f"<CheckResult: {len(self.errors)} errors, {len(self.warnings)} warnings>"

    def _repr_html_(self) -> str:
        if not self:
            return paragraph("nothing found")
        rows = [
            (
                each.severity.value,
                f"{each.file}:{each.line}" if each.line else each.file,
                each.element,
                each.message,
                each.remedy,
                f"{each.rule} {each.number}".strip(),
            )
            for each in self
        ]
        return table(("", "where", "element", "what is wrong", "remedy", "rule"), rows)


def check(
    mission: MissionSource | Mission,
    fleet: FleetSource | None = None,
    *,
    process: str | None = None,
    data: Mapping[str, Value] | None = None,
    search_path: Iterable[str | Path] = (),
) -> CheckResult:
    """Check a mission, alone or against a fleet, as `m2pem check` does.

    A mission or fleet that cannot be read is a finding, too. `process`: the one to begin with, the
    main one by default. `data`: what the mission starts with; names and kinds count here.
    `search_path`: folders of processes that the mission calls.

    Raises:
        FleetError: the fleet names an arbiter that no plugin provides.
    """
    loaded: Mission | None = None
    findings: list[Finding] = []
    usable = True
    try:
        loaded = load_mission(mission, search_path)
    except MissionError as error:
        findings += error.findings
        usable = not any(finding.rule in NO_BPMN_RULES for finding in error.findings)
    try:
        findings += _against_fleet(loaded, fleet, process, data or {})
    except FleetError as error:
        if not error.findings:
            raise
        findings += error.findings
        usable = False
    usable &= not any(finding.rule == "unknown-process" for finding in findings)
    return CheckResult(findings, usable=usable)


def _against_fleet(
    mission: Mission | None,
    fleet: FleetSource | None,
    process: str | None,
    data: Mapping[str, Value],
) -> list[Finding]:
    """The findings of a mission that was read with its fleet; of a fleet alone without one."""
    if mission is None:
        if isinstance(fleet, str | Path) and fleet != DEFAULT_FLEET:
            from m2pem.fleet.fleet_file import load_fleet

            load_fleet(fleet)
        return []
    plugins = PluginManager()
    arbiters = None
    failed: FleetError | None = None
    if fleet is not None:
        try:
            arbiters = arbiters_of(fleet_of(fleet, mission), plugins)
        except FleetError as error:
            if not error.findings:
                raise
            failed = error
    findings = findings_for(mission, arbiters, plugins, data, process)
    findings += requirement_findings(mission, arbiters, plugins, data)
    if failed is not None:
        raise FleetError(failed.what, [*findings, *failed.findings])
    return findings
