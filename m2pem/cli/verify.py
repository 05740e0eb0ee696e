"""`m2pem verify`: properties of a mission, proved before anything moves."""

import signal
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from m2pem.cli.options import (
    UnusableError,
    as_json,
    data_option,
    example,
    fleet_option,
    mission_argument,
    path_option,
    process_option,
    spec_option,
    writing,
)

if TYPE_CHECKING:
    from m2pem.cli.verify_lines import ResultLines
    from m2pem.executive.verification import SearchEngine, SearchRequest
    from m2pem.mission.values import Value
    from m2pem.verify.report.findings import DescribedViolation, Findings
    from m2pem.verify.report.text import Paint
    from m2pem.verify.search.explore import Progress


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
@spec_option
@click.option(
    "--assume",
    metavar="ASSUMPTION",
    multiple=True,
    help="What all runs are taken to do: no-failures, 'failures <= 2', 'reliable(uav1)', "
    "operators-answer, 'messages-within 30 s'. Can be given again.",
)
@click.option(
    "--all-pools",
    is_flag=True,
    help="Begin all pools of a collaboration together, not only one process.",
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
    help="Check nothing: print the input of Spin, or write it to FILE.",
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
    help="Write a report: FILE.md with pictures beside it, FILE.json for programs, FILE.sarif for "
    "CI services, or FILE.svg with the first violation. Can be given again.",
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
@click.option(
    "--exhaustive",
    is_flag=True,
    help="Search on after a violation, to the end or to these limits. Otherwise a large search "
    "ends soon after it.",
)
@click.option(
    "--format",
    "output",
    type=click.Choice(["text", "json", "sarif"]),
    default="text",
    show_default=True,
    help="Print for people, or for programs: JSON, or SARIF 2.1.0 for CI services.",
)
def verify(
    mission: str,
    fleet_file: str | None,
    process: str | None,
    search_path: tuple[Path, ...],
    data: "dict[str, Value]",
    spec: Path | None,
    assume: tuple[str, ...],
    all_pools: bool,
    strict: bool,
    engine: str,
    storage: str,
    emit: str | None,
    timers: str,
    reports: tuple[Path, ...],
    max_states: int,
    max_seconds: float,
    exhaustive: bool,
    output: str,
) -> int:
    """Prove properties and requirements of a mission, or show a run that violates them.

    Ends with 0 if all holds, with 1 if something is violated, with 2 if the mission, the fleet or
    the requirements cannot be used, with 3 if something is undecided, and with 4 if something may
    be violated: the engine did not follow its run. Ctrl-C ends the search: the command reports the
    part that it has searched.
    """
    _refuse_what_does_not_go_together(engine, storage, emit, reports)
    from m2pem.executive.loading import load_source
    from m2pem.executive.verification import SearchEngine
    from m2pem.scripting.verification import TOKENS_ON_A_PLACE, search_request
    from m2pem.verify.report.data import as_data
    from m2pem.verify.report.text import as_text
    from m2pem.verify.search.explore import AFTER_VIOLATION_STATES, Limits

    asked = search_request(
        load_source(mission, search_path),
        fleet_file,
        process,
        data,
        spec,
        timers_in_order=timers == "in-order",
        assume=assume,
        all_pools=all_pools,
    )
    if emit is not None:
        _emit(promela(asked), emit.partition("=")[2])
        return 0
    limits = Limits(
        states=max_states,
        seconds=max_seconds,
        tokens=TOKENS_ON_A_PLACE,
        after_violation=None if exhaustive else AFTER_VIOLATION_STATES,
    )
    lines = _lines(asked, strict=strict) if output == "text" else None
    found = findings(asked, SearchEngine(engine, storage, limits), strict=strict, lines=lines)
    for file in reports:
        write(file, found)
    if lines is not None:
        click.echo(as_text(found, _paint(), printed=lines.printed))
    else:
        click.echo(as_json(as_data(found) if output == "json" else _sarif(found)))
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
    with writing(Path(file)):
        Path(file).write_text(text, encoding="utf-8")


def _sarif(found: "Findings") -> "dict[str, Any]":
    from m2pem import __version__
    from m2pem.verify.report.sarif import as_sarif

    return as_sarif(found, __version__)


def _lines(asked: "SearchRequest", *, strict: bool) -> "ResultLines":
    from m2pem.cli.verify_lines import ResultLines
    from m2pem.verify.properties import NAMES

    names = [*NAMES, *(each.id for each in asked.requirements)]
    return ResultLines(names, _paint(), strict=strict)


def _paint() -> "Paint":
    from m2pem.cli.output import wants_colour
    from m2pem.verify.report.text import plain

    if wants_colour(sys.stdout):
        return lambda text, colour: click.style(text, fg=colour)
    return plain


def findings(
    asked: "SearchRequest",
    engine: "SearchEngine",
    *,
    strict: bool,
    lines: "ResultLines | None" = None,
) -> "Findings":
    """Search, and return the findings. `lines`: prints results as soon as they are certain."""
    from m2pem.executive.verification import search

    with _ended_as_by_hand(), progress() as show:
        if lines is None:
            return search(asked, engine, strict=strict, progress=show)

        def progressed(searched: "Progress") -> None:
            lines.look()
            if show is not None:
                show(searched)

        return search(asked, engine, strict=strict, progress=progressed, decided=lines.decided)


def promela(asked: "SearchRequest") -> str:
    """Return the input of Spin."""
    from m2pem.verify.net.simplify import simplify
    from m2pem.verify.spin.promela import text_of
    from m2pem.verify.translate import translate

    options = replace(asked.options, assumed=asked.assumed)
    system = translate(asked.mission, asked.fleet, process=asked.process, options=options)
    return text_of(simplify(system)).text


@contextmanager
def _ended_as_by_hand() -> Iterator[None]:
    """Let SIGTERM and SIGHUP do what Ctrl-C does within the block: report, and end Spin."""
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
    """Show how far a search is, for a person who looks; None: no person does."""
    from m2pem.cli.notes import progress_line, shows_progress

    if not shows_progress():
        yield None
        return
    with progress_line() as show:
        yield lambda searched: show(lambda: f"{_line(searched)} (Ctrl-C to stop)")


def _line(searched: "Progress") -> str:
    said = [f"searching for {searched.seconds:.0f} s"]
    if searched.states:
        said.append(f"{searched.states:,} states found")
    if searched.waiting:
        said.append(f"{searched.waiting:,} of them to be searched")
    if searched.states and searched.seconds > 0:
        said.append(f"{searched.states / searched.seconds:,.0f} a second")
    if searched.memory_mb:
        said.append(f"{searched.memory_mb:,.0f} MB")
    return ", ".join(said)


KINDS = (".md", ".json", ".sarif", ".svg")
"""Endings of reports' files."""


def write(file: Path, findings: "Findings") -> None:
    """Write a report of the kind that the file's ending says.

    Raises:
        UnusableError: it cannot be written, or the mission cannot be drawn.
    """
    with writing(file):
        if file.suffix == ".json":
            from m2pem.verify.report.data import as_data

            file.write_text(as_json(as_data(findings)) + "\n", encoding="utf-8")
        elif file.suffix == ".sarif":
            file.write_text(as_json(_sarif(findings)) + "\n", encoding="utf-8")
        elif file.suffix == ".svg":
            first = next(iter(findings.violations), None)
            _write_pictures(file, _pictures(findings, first))
        else:
            _write_markdown(file, findings)


def _write_markdown(file: Path, findings: "Findings") -> None:
    from m2pem.verify.report.markdown import as_markdown

    pictures: dict[int, list[str]] = {}
    for number, violation in enumerate(findings.violations):
        if violation.answer.warning and not findings.strict:
            continue
        beside = file.with_name(f"{file.stem}-{number + 1}.svg")
        try:
            drawn = _pictures(findings, violation)
        except UnusableError:  # the report is worth having without it
            break
        pictures[number] = _write_pictures(beside, drawn)
    file.write_text(as_markdown(findings, pictures), encoding="utf-8")


def _write_pictures(file: Path, drawn: Mapping[str, str]) -> list[str]:
    """The first one as `file`, the others beside it: `FILE-PROCESSES.svg`. Answers with names."""
    names = []
    for qualifier, picture in drawn.items():
        each = file.with_stem(f"{file.stem}-{_plain(qualifier)}") if qualifier else file
        each.write_text(picture, encoding="utf-8")
        names.append(each.name)
    return names


def _plain(name: str) -> str:
    """A part of a file's name: qualifiers come from strangers' files."""
    return "".join(each if each.isalnum() or each in "-_" else "_" for each in name)


def _pictures(findings: "Findings", violation: "DescribedViolation | None") -> Mapping[str, str]:
    from m2pem.verify.report.picture import pictures

    try:
        return pictures(findings, violation)
    except ValueError as error:
        raise UnusableError(f"{findings.mission.file} cannot be drawn: {error}") from error
