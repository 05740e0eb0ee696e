"""`m2pem verify`: properties of a mission, proved before anything moves."""

import sys
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
from m2pem.cli.report_files import KINDS, write

if TYPE_CHECKING:
    from m2pem.mission.values import Value
    from m2pem.verify.report.findings import Findings


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
@click.option(
    "--spec",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Requirements (YAML) beside those in the mission's own file.",
)
@click.option("--strict", is_flag=True, help="Warnings are violations.")
@click.option(
    "--engine",
    type=click.Choice(["builtin", "spin"]),
    default="builtin",
    show_default=True,
    help="Who searches: m2pem itself, or the model checker Spin, if it is installed.",
)
@click.option(
    "--storage",
    type=click.Choice(["exact", "collapse", "bitstate"]),
    default="exact",
    show_default=True,
    help="How Spin remembers states: as they are, compressed, or as a few bits, which finds "
    "violations in very large missions but proves nothing.",
)
@click.option(
    "--emit",
    metavar="promela[=FILE]",
    help="Check nothing: print what Spin would be given, or write it to FILE.",
)
@click.option(
    "--timers",
    type=click.Choice(["any", "in-order"]),
    default="any",
    show_default=True,
    help="Whether timers that begin to run together may come in any order, or only in that of "
    "their times.",
)
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
    spec: Path | None,
    strict: bool,
    engine: str,
    storage: str,
    emit: str | None,
    timers: str,
    reports: tuple[Path, ...],
    max_states: int,
    max_seconds: float,
    output: str,
) -> int:
    """Prove properties and requirements of a mission, or show a run that violates them.

    Ends with 0 if all holds, with 1 if something is violated, with 2 if the mission, the fleet or
    the requirements cannot be used, and with 3 if something is undecided. Ctrl-C ends the search:
    what was seen until then is told.
    """
    _refuse_what_does_not_go_together(engine, storage, emit, reports)
    from m2pem.cli.proving import asked_of, findings, promela
    from m2pem.executive.loading import load_source
    from m2pem.executive.proving import Engine
    from m2pem.verify.report.data import as_data
    from m2pem.verify.search.explore import Limits

    asked = asked_of(
        load_source(mission, search_path),
        fleet_file,
        process,
        data,
        spec,
        timers_in_order=timers == "in-order",
    )
    if emit is not None:
        _emit(promela(asked), emit.partition("=")[2])
        return 0
    limits = Limits(states=max_states, seconds=max_seconds, tokens=3)
    found = findings(asked, Engine(engine, storage, limits), strict=strict)
    for file in reports:
        write(file, found)
    if output == "json":
        click.echo(as_json(as_data(found)))
    else:
        click.echo(_text(found))
    return found.exit_status


def _refuse_what_does_not_go_together(
    engine: str, storage: str, emit: str | None, reports: tuple[Path, ...]
) -> None:
    if storage != "exact" and engine != "spin":
        raise click.UsageError(f"--storage {storage} says how Spin searches: add --engine spin")
    if emit is not None and emit.partition("=")[0] != "promela":
        raise click.UsageError(f"--emit {emit}: 'promela' or 'promela=FILE' can be written")
    if emit is not None and reports:
        raise click.UsageError("--emit checks nothing: there is no --report to write")
    for file in reports:
        if file.suffix not in KINDS:
            raise click.UsageError(f"--report {file}: end its name with {', '.join(KINDS)}")


def _emit(text: str, file: str) -> None:
    if not file:
        click.echo(text, nl=False)
        return
    try:
        Path(file).write_text(text, encoding="utf-8")
    except OSError as error:
        raise UnusableError(f"{file} cannot be written: {error.strerror}") from error


def _text(found: "Findings") -> str:
    from m2pem.cli.output import wants_colour
    from m2pem.verify.report.text import as_text

    if wants_colour(sys.stdout):
        return as_text(found, lambda text, colour: click.style(text, fg=colour))
    return as_text(found)
