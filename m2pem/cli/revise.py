"""`m2pem revise`: a running mission goes on with a new version of its file."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from m2pem.cli.options import (
    as_json,
    example,
    format_option,
    journal_option,
    mission_argument,
    path_option,
    run_argument,
)
from m2pem.cli.run_control import ask_driving, ask_of_run, by_option

if TYPE_CHECKING:
    from m2pem.api.revision import RevisionPreview


def _read_moves(_: click.Context, __: click.Parameter, given: tuple[str, ...]) -> dict[str, str]:
    moves: dict[str, str] = {}
    for word in given:
        element, equals, target = word.partition("=")
        if not (element and equals and target):
            raise click.BadParameter(f"{word!r} is not of the form ELEMENT=TARGET")
        if moves.setdefault(element, target) != target:
            raise click.BadParameter(f"{element} can go to one element only")
    return moves


@click.command(epilog=example("m2pem revise r1 missions/vignette1.bpmn --plan"))
@run_argument
@mission_argument
@path_option
@click.option(
    "--move",
    "moves",
    metavar="ELEMENT=TARGET",
    multiple=True,
    callback=_read_moves,
    help="Where the token on an element goes first: another element of its process or subprocess, "
    "or a sequence flow to a join. Can be given again.",
)
@click.option(
    "--end",
    "ended",
    metavar="ELEMENT",
    multiple=True,
    help="The token on this element ends. Can be given again.",
)
@click.option("--plan", "only_plan", is_flag=True, help="Only show what it would do.")
@click.option("--yes", is_flag=True, help="Do it without asking, if nothing is refused.")
@click.option(
    "--even-if-stuck",
    is_flag=True,
    help="Confirm a version with which the mission cannot complete.",
)
@journal_option
@by_option
@format_option
def revise(
    run_id: str,
    mission: str,
    search_path: tuple[Path, ...],
    moves: dict[str, str],
    ended: tuple[str, ...],
    only_plan: bool,
    yes: bool,
    even_if_stuck: bool,
    journal: str | None,
    by: str | None,
    output: str,
) -> None:
    """Go on with a new version of a mission that is running on this host.

    MISSION is the new version. First it is shown what becomes of each token, and of what it
    commands and waits for; then it is asked whether to do it. What would leave a token without a
    place is refused, with where the token can go (--move, --end).
    """
    import msgspec

    from m2pem.api.operations import mission_files
    from m2pem.api.revision import RevisionPreview
    from m2pem.cli.notes import note
    from m2pem.control_socket.client import LONG_TIMEOUT_S
    from m2pem.errors import OperatorError, StuckError
    from m2pem.executive.loading import load_source

    for element in ended:
        if moves.setdefault(element, ""):
            raise click.UsageError(f"the token on {element} cannot both move and end")
    if yes and only_plan:
        raise click.UsageError("--plan does nothing, and --yes does it: give one of both")
    files = mission_files(load_source(mission, search_path))
    params: dict[str, Any] = {"mission": files, "moves": moves, "timeout_s": LONG_TIMEOUT_S}
    plan = ask_driving(journal, run_id, "plan_revision", **params)
    preview = msgspec.convert(plan, RevisionPreview)
    click.echo(as_json(_as_data(preview)) if output == "json" else str(preview))
    if not preview.is_possible:
        raise OperatorError(f"{run_id} is not revised")
    if only_plan:
        return
    if not yes:
        if not sys.stdin.isatty():
            raise OperatorError(f"{run_id} is not revised. --yes does it")
        if not click.confirm(f"Revise {run_id}?", err=output == "json"):
            raise OperatorError(f"{run_id} is not revised")
    params |= {"plan": preview.plan, "even_if_stuck": even_if_stuck}
    try:
        ask_of_run(journal, run_id, "revise", by, **params)
    except StuckError as error:
        raise OperatorError(f"{error}. --even-if-stuck does it all the same") from error
    note(f"{run_id} goes on with version {preview.version[:12]}")


def _as_data(preview: "RevisionPreview") -> dict[str, Any]:
    import msgspec

    return {**msgspec.to_builtins(preview), "is_possible": preview.is_possible}
