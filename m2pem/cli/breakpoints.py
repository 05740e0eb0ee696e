"""`m2pem break`, `step`, `data`, `set`: a run that is debugged while it goes on on this host."""

from typing import TYPE_CHECKING

import click

from m2pem.cli.options import (
    as_json,
    example,
    format_option,
    journal_option,
    read_data,
    run_argument,
)
from m2pem.cli.run_control import ask_of_run, by_option, steer

if TYPE_CHECKING:
    from m2pem.api.runs import ScopeData
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


@click.command(epilog=example("m2pem data r1"))
@run_argument
@format_option
@journal_option
@by_option
def data(run_id: str, output: str, journal: str | None, by: str | None) -> None:
    """Print the data of a run that is running on this host.

    First that of its data stores, then of each active process, and of subprocesses and tasks that
    have some.
    """
    import msgspec

    from m2pem.api.runs import ScopeData

    found = ask_of_run(journal, run_id, "data", by)
    if output == "json":
        click.echo(as_json({"data": found}))
        return
    for each in msgspec.convert(found, list[ScopeData]):
        click.echo(f"{_title(each)}:")
        for name, value in each.data.items():
            click.echo(f"  {name} = {msgspec.json.encode(value).decode()}")
        if not each.data:
            click.echo("  nothing")


def _title(scope: "ScopeData") -> str:
    """Whose data it is, and how it is changed."""
    changed = f"--scope {scope.scope}" if scope.scope is not None else "cannot be changed"
    if not scope.element:
        return f"data stores ({changed})"
    instance = "" if scope.instance is None else f", instance {scope.instance}"
    return f"{scope.element}{instance} ({changed})"


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
