"""`m2pem check`: everything that is wrong or doubtful about a mission."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from m2pem.cli.options import (
    as_json,
    data_option,
    example,
    fleet_option,
    format_option,
    mission_argument,
    path_option,
    process_option,
)
from m2pem.errors import FleetError, MissionError
from m2pem.findings import Finding, Severity, escaped, has_errors, lines

if TYPE_CHECKING:
    from m2pem.mission.mission import Mission
    from m2pem.mission.values import Value

UNUSABLE = 2


@click.command(
    epilog=example(
        "m2pem check missions/vignette1.bpmn --fleet fleet_configs/vignette1.yaml --strict"
    )
)
@mission_argument
@fleet_option(required=False)
@process_option
@path_option
@data_option
@click.option("--strict", is_flag=True, help="Warnings are errors.")
@format_option
def check(
    mission: str,
    fleet_file: str | None,
    process: str | None,
    search_path: tuple[Path, ...],
    data: "dict[str, Value]",
    strict: bool,
    output: str,
) -> int:
    """Check a mission file, alone or against a fleet.

    Prints every finding. Ends with 0 if none is an error, with 1 if one is, and with 2 if the
    mission is no BPMN at all, it has no such process, or the fleet cannot be used.
    """
    findings, unusable = _check(mission, fleet_file, process, search_path, data)
    if output == "json":
        click.echo(as_json(findings))
    else:
        for line in lines(findings):
            click.echo(line)
        click.echo(_summary(mission, findings))
    if unusable:
        return UNUSABLE
    return 1 if has_errors(findings) or (strict and findings) else 0


def _check(
    mission_file: str,
    fleet_file: str | None,
    process: str | None,
    search_path: tuple[Path, ...],
    data: "dict[str, Value]",
) -> tuple[list[Finding], bool]:
    """Return all findings, and whether the file has no BPMN at all."""
    from m2pem.bpmn import NO_BPMN_RULES
    from m2pem.executive.loading import load_source

    mission: Mission | None = None
    findings: list[Finding] = []
    unusable = False
    try:
        mission = load_source(mission_file, search_path)
    except MissionError as error:
        findings += error.findings
        unusable = any(finding.rule in NO_BPMN_RULES for finding in error.findings)
    try:
        findings += _against_fleet(mission, fleet_file, process, data)
        unusable |= any(finding.rule == "unknown-process" for finding in findings)
    except FleetError as error:
        findings += error.findings
        unusable = True
    return findings, unusable


def _against_fleet(
    mission: "Mission | None", fleet_file: str | None, process: str | None, data: "dict[str, Value]"
) -> list[Finding]:
    from m2pem.cli.options import MADE_UP
    from m2pem.executive.loading import findings_for, requirement_findings
    from m2pem.plugins import PluginManager

    if mission is None:
        if fleet_file is not None and fleet_file != MADE_UP:
            from m2pem.fleet.fleet_file import load_fleet

            load_fleet(fleet_file)
        return []
    plugins = PluginManager()
    arbiters = None
    failed: FleetError | None = None
    if fleet_file is not None:
        from m2pem.cli.arguments import arbiters_of, get_fleet

        try:
            arbiters = arbiters_of(get_fleet(fleet_file, mission), plugins)
        except FleetError as error:
            failed = error
    findings = findings_for(mission, arbiters, plugins, tuple(data), process)
    findings += requirement_findings(mission, arbiters, plugins, tuple(data))
    if failed is not None:
        raise FleetError(failed.what, [*findings, *failed.findings])
    return findings


def _summary(mission: str, findings: list[Finding]) -> str:
    """Return the number of findings of each file, the mission's own last."""
    if not findings:
        return f"{escaped(mission)}: nothing found"
    files = sorted(dict.fromkeys(each.file for each in findings), key=lambda file: file == mission)
    return "\n".join(_counts(file, findings) for file in files)


def _counts(file: str, findings: list[Finding]) -> str:
    own = [finding.severity is Severity.ERROR for finding in findings if finding.file == file]
    errors = sum(own)
    counts = [
        f"{count} {word}{'' if count == 1 else 's'}"
        for count, word in ((errors, "error"), (len(own) - errors, "warning"))
        if count
    ]
    return f"{escaped(file)}: {', '.join(counts)}"
