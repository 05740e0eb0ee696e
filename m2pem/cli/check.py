"""`m2pem check`: everything that is wrong or doubtful about a mission."""

from collections.abc import Sequence
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
from m2pem.findings import Finding, Severity, escaped, lines

if TYPE_CHECKING:
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
    from m2pem.scripting.checking import check as check_mission

    findings = check_mission(
        mission, fleet_file, process=process, data=data, search_path=search_path
    )
    if output == "json":
        click.echo(as_json(list(findings)))
    else:
        for line in lines(findings):
            click.echo(line)
        click.echo(_summary(mission, findings))
    if not findings.usable:
        return UNUSABLE
    return 1 if not findings.ok or (strict and findings) else 0


def _summary(mission: str, findings: Sequence[Finding]) -> str:
    """Return the number of findings of each file, the mission's own last."""
    if not findings:
        return f"{escaped(mission)}: nothing found"
    files = sorted(dict.fromkeys(each.file for each in findings), key=lambda file: file == mission)
    return "\n".join(_counts(file, findings) for file in files)


def _counts(file: str, findings: Sequence[Finding]) -> str:
    own = [finding.severity is Severity.ERROR for finding in findings if finding.file == file]
    errors = sum(own)
    counts = [
        f"{count} {word}{'' if count == 1 else 's'}"
        for count, word in ((errors, "error"), (len(own) - errors, "warning"))
        if count
    ]
    return f"{escaped(file)}: {', '.join(counts)}"
