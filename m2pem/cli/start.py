"""`m2pem start`: a mission for an executive that is running on this host."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from m2pem.cli.options import (
    data_option,
    example,
    journal_option,
    mission_argument,
    path_option,
    process_option,
)
from m2pem.cli.run_control import by_option, journal_file

if TYPE_CHECKING:
    from m2pem.mission.values import Value


@click.command(epilog=example("m2pem start missions/vignette1.bpmn"))
@mission_argument
@process_option
@path_option
@data_option
@click.option(
    "--run-on",
    metavar="EXECUTIVE",
    help="Which executive, if several write to the journal: its process id or its fleet's name.",
)
@click.option(
    "--even-if-busy", is_flag=True, help="Start although other runs or operators have its vehicles."
)
@journal_option
@by_option
def start(
    mission: str,
    process: str | None,
    search_path: tuple[Path, ...],
    data: "dict[str, Value]",
    run_on: str | None,
    even_if_busy: bool,
    journal: str | None,
    by: str | None,
) -> None:
    """Start a mission in an executive that is running on this host.

    `m2pem serve` is one, with its fleet. Prints the id of the run, and before it, as notes, the
    warnings that `m2pem check` has of the mission with that fleet. The files of the mission are
    read here, and sent.
    """
    import msgspec

    from m2pem.api.operations import mission_files
    from m2pem.api.operator import operator_name
    from m2pem.cli.notes import note
    from m2pem.control_socket.client import LONG_TIMEOUT_S, ask, choose_executive
    from m2pem.executive.loading import load_source
    from m2pem.findings import Finding, has_errors, lines

    path = choose_executive(journal_file(journal), run_on)
    loaded = load_source(mission, search_path)
    files = mission_files(loaded)
    found = ask(
        path, "check", timeout_s=LONG_TIMEOUT_S, mission=files, process=process, data=list(data)
    )
    findings = msgspec.convert(found, list[Finding])
    if not has_errors(findings):  # else the refusal has them all
        for line in lines(findings):
            note(line)
    run = ask(
        path,
        "start",
        timeout_s=LONG_TIMEOUT_S,
        mission=files,
        process=process,
        data=data,
        by=by or operator_name(),
        even_if_busy=even_if_busy,
    )
    click.echo(run)
