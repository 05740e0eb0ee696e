"""`m2pem take` and `m2pem give-back`: an operator steers a vehicle or payload by hand."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from m2pem.cli.options import example, journal_option
from m2pem.cli.run_control import by_option, executives_here

if TYPE_CHECKING:
    from m2pem.api.allocation import TakeEffect


@click.command(epilog=example("m2pem take uav1"))
@click.argument("resource")
@click.option("--yes", is_flag=True, help="Take it without asking, whatever this ends.")
@click.option("--ask", "asks", is_flag=True, help="Ask the operator who has it to hand it over.")
@journal_option
@by_option
def take(resource: str, yes: bool, asks: bool, journal: str | None, by: str | None) -> None:
    """Take a vehicle or payload from the missions, to steer it by hand.

    First it is said which tasks this ends, and whether their missions go on; then it is asked.
    """
    from m2pem.api.operator import operator_name
    from m2pem.cli.notes import note
    from m2pem.control_socket.client import ask
    from m2pem.errors import OperatorError

    path = _executive_of(resource, journal)
    if asks:
        ask(path, "request_control", resource=resource, by=by or operator_name())
        note(f"{resource} is asked for; `m2pem operators` shows who is asked, and how long")
        return
    agreed: list[TakeEffect] = []
    while not yes and (effects := _effects(path, resource)) != agreed:
        for each in effects:
            click.echo(str(each))
        if not effects:
            break  # what it did has ended while the operator was asked
        if not sys.stdin.isatty():
            raise OperatorError(f"{resource} is not taken. --yes takes it all the same")
        if not click.confirm(f"Take {resource}?"):
            raise OperatorError(f"{resource} is not taken")
        agreed = effects
    ask(path, "take", resource=resource, by=by or operator_name())
    note(f"{resource} is taken; `m2pem give-back {resource}` gives it back to the missions")


@click.command(epilog=example("m2pem give-back uav1"))
@click.argument("resource")
@click.option(
    "--force",
    "reason",
    metavar="REASON",
    default="",
    help="Give back what an operator has who is gone; all operators see why.",
)
@journal_option
@by_option
def give_back(resource: str, reason: str, journal: str | None, by: str | None) -> None:
    """Give a vehicle or payload that an operator has taken back to the missions.

    They may command it again from then on: it may move. Who has it gives it back; others only as
    docs/operating.md says under "Handing over".
    """
    from m2pem.api.operator import operator_name
    from m2pem.cli.notes import note
    from m2pem.control_socket.client import ask

    path = _executive_of(resource, journal)
    ask(path, "give_back", resource=resource, reason=reason, by=by or operator_name())
    note(f"{resource} is given back")


@click.command(epilog=example("m2pem hand-over uav1"))
@click.argument("resource")
@click.option("--refuse", is_flag=True, help="Keep it; of one who has asked: ask no longer.")
@journal_option
@by_option
def hand_over(resource: str, refuse: bool, journal: str | None, by: str | None) -> None:
    """Give a vehicle or payload to the operator who asks for it, or refuse."""
    from m2pem.api.operator import operator_name
    from m2pem.cli.notes import note
    from m2pem.control_socket.client import ask

    path = _executive_of(resource, journal)
    give = not refuse
    ask(path, "answer_control", resource=resource, give=give, by=by or operator_name())
    note(f"{resource} is handed over" if give else f"{resource} is not handed over")


def _effects(path: Path, resource: str) -> "list[TakeEffect]":
    import msgspec

    from m2pem.api.allocation import TakeEffect
    from m2pem.control_socket.client import ask

    return msgspec.convert(ask(path, "preview_take", resource=resource), list[TakeEffect])


def _executive_of(resource: str, journal: str | None) -> Path:
    """The socket of the executive on this host whose fleet has the resource.

    Raises:
        OperatorError: no fleet has it.
    """
    from m2pem.control_socket.client import ask
    from m2pem.errors import OperatorError
    from m2pem.suggestions import suggest

    known: list[str] = []
    for path in executives_here(journal):
        found = ask(path, "holders")
        if resource in found:
            return path
        known += found
    near = suggest(resource, known, "resources")
    raise OperatorError(f"no fleet of an executive here has {resource}; {near}")
