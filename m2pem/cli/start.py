"""`m2pem start`: a mission for an executive that is running on this host."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from m2pem.cli.later import later_options, scheduled_start
from m2pem.cli.options import (
    data_option,
    example,
    journal_option,
    mission_argument,
    path_option,
    process_option,
    run_on_option,
)
from m2pem.cli.run_control import by_option, found_elsewhere, journal_file

if TYPE_CHECKING:
    from m2pem.mission.values import Value


@click.command(epilog=example("m2pem start missions/vignette1.bpmn"))
@mission_argument
@process_option
@path_option
@data_option
@run_on_option
@click.option(
    "--even-if-busy", is_flag=True, help="Start although other runs or operators have its vehicles."
)
@later_options
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
    **later: Any,
) -> None:
    """Start a mission in an executive that is running on this host.

    `m2pem serve` is one, with its fleet. Prints the id of the run, and before it, as notes, the
    warnings that `m2pem check` has of the mission with that fleet. The files of the mission are
    read here, and sent.

    With one of the options from --when to --concurrency, the mission starts later: it is kept in
    the schedule, and the id of its entry is printed. `m2pem schedule` lists what starts when.
    """
    import msgspec

    from m2pem.api.operations import mission_files
    from m2pem.api.operator import operator_name
    from m2pem.cli.notes import note
    from m2pem.control_socket.client import LONG_TIMEOUT_S, ask, choose_executive
    from m2pem.executive.loading import load_source
    from m2pem.findings import Finding, has_errors, lines

    priority, when = scheduled_start(later)
    if when is not None and even_if_busy:
        raise click.UsageError(
            "a mission that starts later waits for its vehicles: no --even-if-busy"
        )
    with found_elsewhere(journal):
        path = choose_executive(journal_file(journal), run_on)
    loaded = load_source(mission, search_path)
    sent: dict[str, Any] = {
        "timeout_s": LONG_TIMEOUT_S,
        "mission": mission_files(loaded),
        "process": process,
    }
    findings = msgspec.convert(ask(path, "check", **sent, data=list(data)), list[Finding])
    if not has_errors(findings):  # else the refusal has them all
        for line in lines(findings):
            note(line)
    sent |= {"data": data, "by": by or operator_name()}
    if when is not None:
        sent |= {"when": msgspec.to_builtins(when), "priority": priority}
        click.echo(ask(path, "schedule", **sent))
    else:
        click.echo(ask(path, "start", **sent, even_if_busy=even_if_busy))
