"""`m2pem verify`: properties of a mission, proved before anything moves."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from m2pem.cli.options import (
    UnusableError,
    as_json,
    data_option,
    example,
    fleet_option,
    format_option,
    mission_argument,
    path_option,
    process_option,
)

if TYPE_CHECKING:
    from m2pem.model.mission import Mission
    from m2pem.model.values import Value
    from m2pem.verify.explore import Limits
    from m2pem.verify.explore import Progress as Searched
    from m2pem.verify.report.findings import Findings

KINDS = (".md", ".json", ".svg")
"""Endings of reports' files."""


@click.command(
    epilog=example(
        "m2pem verify missions/vignette1.bpmn --fleet fleet_configs/vignette1.yaml "
        "--report vignette1.md"
    )
)
@mission_argument
@fleet_option(required=False)
@process_option
@path_option
@data_option
@click.option("--strict", is_flag=True, help="Warnings are violations.")
@click.option(
    "--report",
    "reports",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    multiple=True,
    help="Write a report: FILE.md with pictures beside it, FILE.json for programs, or FILE.svg "
    "with the first violation. Can be given again.",
)
@click.option(
    "--max-states",
    type=click.IntRange(min=1),
    default=2_000_000,
    show_default=True,
    help="States after which the search ends undecided.",
)
@click.option(
    "--max-seconds",
    type=click.FloatRange(min=0, min_open=True),
    default=600.0,
    show_default=True,
    help="Time after which the search ends undecided.",
)
@format_option
def verify(
    mission: str,
    fleet_file: str | None,
    process: str | None,
    search_path: tuple[Path, ...],
    data: "dict[str, Value]",
    strict: bool,
    reports: tuple[Path, ...],
    max_states: int,
    max_seconds: float,
    output: str,
) -> int:
    """Prove properties of a mission, or show a run that violates them.

    Ends with 0 if all holds, with 1 if something is violated, with 2 if the mission or the fleet
    cannot be used, and with 3 if something is undecided. Ctrl-C ends the search: what was seen
    until then is told.
    """
    from m2pem.executive.loading import load_source
    from m2pem.verify.explore import Limits
    from m2pem.verify.report.data import as_data

    for file in reports:
        if file.suffix not in KINDS:
            raise click.UsageError(f"--report {file}: end its name with {', '.join(KINDS)}")
    loaded = load_source(mission, search_path)
    limits = Limits(states=max_states, seconds=max_seconds, tokens=3)
    findings = _findings(loaded, fleet_file, process, data, limits, strict=strict)
    for file in reports:
        _write(file, findings)
    if output == "json":
        click.echo(as_json(as_data(findings)))
    else:
        click.echo(_text(findings))
    return findings.exit_status


def _findings(
    mission: "Mission",
    fleet_file: str | None,
    process: str | None,
    data: "dict[str, Value]",
    limits: "Limits",
    *,
    strict: bool,
) -> "Findings":
    from m2pem.cli.fleets import arbiters_of
    from m2pem.cli.given import get_fleet
    from m2pem.executive.loading import findings_for, refuse_errors
    from m2pem.plugins import PluginManager
    from m2pem.verify.check import check
    from m2pem.verify.derive.options import Options
    from m2pem.verify.report.findings import findings_of

    plugins = PluginManager()
    fleet = get_fleet(fleet_file, mission) if fleet_file is not None else None
    arbiters = arbiters_of(fleet, plugins) if fleet is not None else None
    wrong = findings_for(mission, arbiters, plugins, tuple(data), process)
    refuse_errors(f"{mission.file} cannot be verified: `m2pem check` finds errors", wrong)
    writes = {name: tuple(plugins.service(name)().writes) for name in plugins.services()}
    options = Options(data=data, service_writes=writes)
    with _progress() as show:
        report = check(
            mission, fleet, process=process, options=options, limits=limits, progress=show
        )
    return findings_of(mission, report, strict=strict, given=data)


@contextmanager
def _progress() -> "Iterator[Callable[[Searched], None] | None]":
    """A line on standard error that counts up, for a person who looks."""
    if not sys.stderr.isatty():
        yield None
        return
    shown = False

    def show(searched: "Searched") -> None:
        nonlocal shown
        if searched.seconds > 1:
            shown = True
            counts = (
                f"{searched.states:,} states found, {searched.waiting:,} of them to be searched"
            )
            print(f"\r\033[K{counts} (Ctrl-C to stop)", end="", file=sys.stderr, flush=True)

    yield show
    if shown:
        print("\r\033[K", end="", file=sys.stderr, flush=True)


def _text(findings: "Findings") -> str:
    from m2pem.cli.output import wants_colour
    from m2pem.verify.report.text import as_text

    if wants_colour(sys.stdout):
        return as_text(findings, lambda text, colour: click.style(text, fg=colour))
    return as_text(findings)


# --- files ----------------------------------------------------------------------------------------


def _write(file: Path, findings: "Findings") -> None:
    try:
        if file.suffix == ".json":
            from m2pem.verify.report.data import as_data

            file.write_text(as_json(as_data(findings)) + "\n", encoding="utf-8")
        elif file.suffix == ".svg":
            first = next(iter(findings.violations), None)
            file.write_text(_picture(findings, first), encoding="utf-8")
        else:
            _write_markdown(file, findings)
    except OSError as error:
        raise UnusableError(f"{file} cannot be written: {error.strerror}") from error


def _write_markdown(file: Path, findings: "Findings") -> None:
    from m2pem.verify.report.markdown import as_markdown

    pictures: dict[int, str] = {}
    for number, violation in enumerate(findings.violations):
        if violation.answer.warning and not findings.strict:
            continue
        beside = file.with_name(f"{file.stem}-{number + 1}.svg")
        try:
            drawn = _picture(findings, violation)
        except UnusableError:  # the report is worth having without it
            break
        beside.write_text(drawn, encoding="utf-8")
        pictures[number] = beside.name
    file.write_text(as_markdown(findings, pictures), encoding="utf-8")


def _picture(findings: "Findings", violation: object) -> str:
    from m2pem.verify.report.findings import Violated
    from m2pem.verify.report.picture import picture

    assert violation is None or isinstance(violation, Violated)
    try:
        return picture(findings, violation)
    except ValueError as error:
        raise UnusableError(f"{findings.mission.file} cannot be drawn: {error}") from error
