"""`m2pem break`, `step` and `set`: a run that is debugged while it is running on this host."""

from typing import TYPE_CHECKING

import click

from m2pem.cli.options import example, journal_option, read_data, run_argument
from m2pem.cli.run_control import by_option, steer

if TYPE_CHECKING:
    from m2pem.mission.values import Value


@click.command(epilog=example("m2pem break r1 DriveRoute --when 'detection.type != null'"))
@run_argument
@click.argument("elements", nargs=-1, metavar="[ELEMENT]...")
@click.option(
    "--when",
    "conditions",
    multiple=True,
    metavar="CONDITION",
    help="Pause it when the condition has become true. Can be given again.",
)
@journal_option
@by_option
def break_(
    run_id: str,
    elements: tuple[str, ...],
    conditions: tuple[str, ...],
    journal: str | None,
    by: str | None,
) -> None:
    """Set the breakpoints of a run that is running on this host.

    It is paused, and its vehicles held, where a token has come to an ELEMENT, before the element
    does anything. In place of the breakpoints before; without any, they are deleted.
    """
    where = [*elements, *(f"when {each}" for each in conditions)]
    done = f"{run_id}: breakpoints: {', '.join(where) or 'none'}"
    steer(
        *(journal, run_id, "set_breakpoints", by, done),
        elements=list(elements),
        conditions=list(conditions),
    )


@click.command(epilog=example("m2pem step r1"))
@run_argument
@journal_option
@by_option
def step(run_id: str, journal: str | None, by: str | None) -> None:
    """Execute one step of a paused run on this host.

    It is paused again before the next one. Where all its tokens wait, it goes on until one moves.
    """
    steer(journal, run_id, "step", by, f"{run_id} makes one step")


def _data(_: click.Context, __: click.Parameter, words: tuple[str, ...]) -> "dict[str, Value]":
    return read_data(words)


@click.command(epilog=example("m2pem set r1 user.decision=abort"))
@run_argument
@click.argument("data", nargs=-1, required=True, metavar="NAME=VALUE...", callback=_data)
@click.option(
    "--scope",
    type=click.IntRange(min=1),
    default=1,
    metavar="NUMBER",
    help="Of the process or subprocess that sees it, as in records  [default: the first process]",
)
@journal_option
@by_option
def set_(
    run_id: str, data: "dict[str, Value]", scope: int, journal: str | None, by: str | None
) -> None:
    """Change data of a paused run on this host."""
    done = f"{run_id}: changed: {', '.join(data)}"
    steer(journal, run_id, "set_data", by, done, data=data, scope=scope)
