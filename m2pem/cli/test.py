"""`m2pem test`: the scenarios of missions, and what they do not cover."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from m2pem.cli.options import UnusableError, as_json, example, format_option, writing

if TYPE_CHECKING:
    from collections.abc import Iterator

    from m2pem.coverage.report import Report


@click.command(epilog=example("m2pem test missions/vignette1.bpmn"))
@click.argument(
    "paths",
    metavar="[MISSION|FOLDER]...",
    nargs=-1,
    type=click.Path(exists=True, path_type=Path),
)
@click.option(
    "--fleet",
    "fleet_file",
    metavar="FLEET",
    default="sim",
    show_default=True,
    help="Of missions without a file of scenarios, which names its own.",
)
@click.option(
    "--complete",
    is_flag=True,
    help="Fail also if an element, flow or end is neither seen nor named as unreached.",
)
@click.option("--suggest", is_flag=True, help="Look for answers files that reach the rest.")
@click.option(
    "--add", is_flag=True, help="Add what is suggested to the files of scenarios, as scenarios."
)
@click.option(
    "--max-seconds",
    type=click.FloatRange(min=0, min_open=True),
    default=60.0,
    show_default=True,
    help="Time for the search of each mission's states, and for answers that are suggested.",
)
@click.option(
    "--junit",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Write JUnit XML for CI services, too.",
)
@format_option
def test(
    paths: tuple[Path, ...],
    fleet_file: str,
    complete: bool,
    suggest: bool,
    add: bool,
    max_seconds: float,
    junit: Path | None,
    output: str,
) -> int:
    """Rehearse the scenarios of missions, and say what they never see.

    The scenarios of NAME.bpmn are in NAME.test.yaml beside it. Tests the missions that are named,
    and those in folders that are named  [default: the current folder]. Ends with 0 if all pass, 1
    if something fails, 2 if a file cannot be used.
    """
    from dataclasses import replace

    from m2pem.cli.notes import progress_line
    from m2pem.coverage import report as reports_of
    from m2pem.coverage.suite import LIMITS, Wanted, find_targets, reports_on
    from m2pem.plugins import PluginManager

    targets = find_targets(paths or [Path()])
    if not targets:
        raise UnusableError("there is no mission in these folders")
    limits = replace(LIMITS, seconds=max_seconds)
    wanted = Wanted(limits, fleet_file, complete, suggest or add)
    reports: list[Report] = []
    with progress_line() as show:
        for report in reports_on(targets, wanted, PluginManager(), lambda text: show(lambda: text)):
            reports.append(report)
            if output == "text":
                _print(reports_of.text_of(report))
            if add:
                _add(report, fleet_file)
    if output == "json":
        click.echo(as_json(reports_of.as_data(reports)))
    else:
        click.echo(reports_of.summary_of(reports))
    if junit is not None:
        with writing(junit):
            junit.write_bytes(reports_of.junit_of(reports))
    return reports_of.exit_status_of(reports)


def _print(lines: "Iterator[str]") -> None:
    from m2pem.findings import escaped

    for line in lines:
        click.echo(escaped(line))


def _add(report: "Report", fleet: str) -> None:
    from m2pem.cli.notes import note
    from m2pem.coverage.adding import add_scenarios
    from m2pem.coverage.mission_test import MissionReport
    from m2pem.coverage.scenario_file import SUFFIX

    if not isinstance(report, MissionReport) or not report.suggestions:
        return
    file = report.scenarios or report.mission.with_suffix(SUFFIX)
    with writing(file):
        count = add_scenarios(file, fleet, report.suggestions)
    note(f"{count} scenarios were added to {file}")
